//! `glsl/olbvh.glsl` for the shaders of other programs: one file, whose names have a prefix.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Appends the file `name` of `folder` to `out`, with its includes in place, each of them once.
fn flatten(folder: &Path, name: &str, seen: &mut BTreeSet<String>, out: &mut String) -> Result<(), String> {
    if !seen.insert(name.to_owned()) {
        return Ok(());
    }
    let path = folder.join(name);
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    for line in text.lines() {
        if let Some(included) = line.strip_prefix("#include \"").and_then(|l| l.strip_suffix('"')) {
            flatten(folder, included, seen, out)?;
        } else {
            out.push_str(line);
            out.push('\n');
        }
    }
    Ok(())
}

pub fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The name that a line at the outermost level declares: a struct, a constant, a variable, a function, a buffer, a
/// macro.
fn declared(line: &str) -> Option<&str> {
    if let Some(of_macro) = line.strip_prefix("#define ") {
        return of_macro.split(|c| !is_word(c)).next();
    }
    if let Some(buffer) = line.strip_prefix("OLBVH_BUFFER(") {
        return buffer.strip_suffix(')')?.rsplit(", ").next();
    }
    if !line.starts_with(|c: char| c.is_alphabetic()) {
        return None;
    }
    let mut words = line.split_whitespace().skip_while(|w| *w == "const").take(2);
    let (_kind, name) = (words.next()?, words.next()?);
    let name = &name[..name.find(|c| !is_word(c)).unwrap_or(name.len())];
    (!name.is_empty()).then_some(name)
}

/// The text with the prefix `olbvh_` before every declared name, wherever it occurs as a word outside of comments and
/// is not a member of a struct.
fn prefix(text: &str) -> String {
    let names: BTreeSet<&str> = text.lines().filter_map(declared).filter(|n| !n.to_lowercase().starts_with("olbvh_")).collect();
    let is_ours = |word: &str| names.contains(word) || word.strip_suffix("Block").is_some_and(|w| names.contains(w));
    let mut out = String::with_capacity(text.len() * 5 / 4);
    let mut in_struct = false;
    for line in text.lines() {
        let (code, comment) = line.find("//").map_or((line, ""), |at| line.split_at(at));
        let mut rest = code;
        while !rest.is_empty() {
            let word = &rest[..rest.find(|c| !is_word(c)).unwrap_or(rest.len())];
            let member = out.ends_with('.') || in_struct && rest[word.len()..].starts_with([';', '[', ',']);
            if is_ours(word) && !member {
                out.push_str("olbvh_");
            }
            let end = if word.is_empty() { rest.chars().next().map_or(0, char::len_utf8) } else { word.len() };
            in_struct = (in_struct || word == "struct") && !rest.starts_with('}');
            out.push_str(&rest[..end]);
            rest = &rest[end..];
        }
        out.push_str(comment);
        out.push('\n');
    }
    out
}

/// The text of `olbvh::glsl::OLBVH`.
pub fn export(folder: &Path) -> Result<String, String> {
    let mut text = String::new();
    flatten(folder, "olbvh.glsl", &mut BTreeSet::new(), &mut text)?;
    Ok(prefix(&text))
}
