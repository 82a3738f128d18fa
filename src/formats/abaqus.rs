//! Reader for input files of Abaqus and CalculiX (`.inp`): nodes and elements, of the model or of parts and their
//! instances. All else, such as materials, loads and steps, is passed over.

mod model;

use std::collections::HashMap;
use std::path::PathBuf;

use super::LoadOptions;
use super::assemble::Assembly;
use super::source::{Source, excerpt};
use super::tokens::{Tokens, parse_float, parse_integer};
use crate::error::Result;
use model::{Block, Body, Element, Instance, Model};

/// Most files within each other.
const MOST_DEEP: usize = 8;
/// Keywords that make nodes or elements out of others; without them the mesh would have holes.
const GENERATORS: [&str; 8] = ["NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "ELEMENT MATRIX"];

pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let mut reader = Reader::default();
    reader.whole(source)?;
    if let twice @ Some(_) = reader.model.node_given_twice() {
        // Lines are not kept; a second reading finds that of this node.
        Reader { twice, ..Reader::default() }.whole(source)?;
    }
    let mut assembly = Assembly::new(source, options, "Abaqus input file".into());
    reader.model.assemble(source, &mut assembly)?;
    Ok(assembly)
}

/// The files that an input file names in its keywords.
pub(super) fn included(source: &Source) -> Vec<PathBuf> {
    let (mut lines, mut found) = (Tokens::new(source, None), Vec::new());
    while let Ok(Some((line, _))) = lines.line() {
        let line = line.trim_ascii();
        if line.starts_with(b"*") && !line.starts_with(b"**") {
            let line = line.to_vec();
            let Ok(keyword) = Keyword::read(line, &mut lines) else { break };
            found.extend(keyword.get("INPUT").map(|name| source.beside(name)));
        }
    }
    found
}

/// What data lines hold.
#[derive(Default)]
enum Section {
    Nodes,
    /// Elements of the last block of the part.
    Elements,
    /// Where an instance is; the number of lines so far.
    Instance(usize),
    #[default]
    Other,
}

#[derive(Default)]
struct Reader {
    model: Model,
    section: Section,
    /// The body that nodes and elements belong to; 0: the model.
    part: usize,
    /// Numbers of an element that goes on in the next line.
    pending: Vec<i64>,
    /// A node, by its body and its place there, that another one has the number of.
    twice: Option<[usize; 2]>,
}

/// A keyword in upper case, without its star, and its parameters, whose names are in upper case.
struct Keyword {
    name: String,
    parameters: HashMap<String, String>,
}

impl Keyword {
    /// Reads a keyword whose first line this is: it goes on after a comma at the end, and comments do not end it.
    fn read(mut line: Vec<u8>, lines: &mut Tokens<'_>) -> Result<Self> {
        while line.ends_with(b",")
            && let Some((more, _)) = lines.line()?
        {
            if !more.trim_ascii_start().starts_with(b"**") {
                line.extend_from_slice(more.trim_ascii());
            }
        }
        Ok(Self::new(&line))
    }

    fn new(line: &[u8]) -> Self {
        let text = String::from_utf8_lossy(line).into_owned();
        // Names in quotation marks may have commas; a single mark is one of inches.
        let (mut quoted, paired) = (false, text.matches('"').count().is_multiple_of(2));
        let mut fields = text.trim_start_matches('*').split(|c| {
            quoted ^= paired && c == '"';
            c == ',' && !quoted
        });
        let upper = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ").to_uppercase();
        let name = upper(fields.next().unwrap_or_default());
        let parameter = |field: &str| {
            let (name, value) = field.split_once('=').unwrap_or((field, ""));
            (upper(name), value.trim().trim_matches('"').to_owned())
        };
        Self { name, parameters: fields.map(parameter).collect() }
    }

    fn get(&self, parameter: &str) -> Option<&str> {
        self.parameters.get(parameter).map(String::as_str)
    }
}

impl Reader {
    fn body(&mut self) -> &mut Body {
        &mut self.model.bodies[self.part]
    }

    fn whole(&mut self, source: &Source) -> Result<()> {
        self.file(source, 1)?;
        self.end_of_section(source, source.len())
    }

    fn file(&mut self, source: &Source, deep: usize) -> Result<()> {
        let mut lines = Tokens::new(source, None);
        while let Some((line, at)) = lines.line()? {
            let line = line.trim_ascii();
            if line.is_empty() || line.starts_with(b"**") {
                continue;
            }
            if !line.starts_with(b"*") {
                self.data(source, line, at)?;
                continue;
            }
            let line = line.to_vec();
            let keyword = Keyword::read(line, &mut lines)?;
            // The lines of an included file stand where it is included, so a section may go on in it, and after it.
            if keyword.name != "INCLUDE" {
                self.end_of_section(source, at)?;
                self.begin(source, &keyword, at)?;
            }
            self.include(source, &keyword, at, deep)?;
        }
        Ok(())
    }

    /// Nothing of a section may be left over.
    fn end_of_section(&mut self, source: &Source, at: usize) -> Result<()> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let (found, element) = (self.pending.len() - 1, self.pending[0]);
        Err(source.error_line(at, format!("element {element} ends after {found} nodes, fewer than its type has")))
    }

    /// Begins the section of a keyword.
    fn begin(&mut self, source: &Source, keyword: &Keyword, at: usize) -> Result<()> {
        let fail = |message: String| Err(source.error_line(at, message));
        self.section = Section::Other;
        let name = || keyword.get("NAME").unwrap_or_default().to_uppercase();
        match keyword.name.as_str() {
            "NODE" => {
                if let Some(system) = keyword.get("SYSTEM").filter(|system| !system.eq_ignore_ascii_case("R")) {
                    return fail(format!("coordinates of the system `{}`; write them as x, y and z", excerpt(system.as_bytes())));
                }
                self.section = Section::Nodes;
            }
            "ELEMENT" => {
                let Some(given) = keyword.get("TYPE") else { return fail("*ELEMENT without TYPE".into()) };
                let block = Block::new(Element::of(given), keyword.get("ELSET"));
                self.body().blocks.push(block);
                self.section = Section::Elements;
            }
            "PART" => {
                self.part = self.model.bodies.len();
                self.model.bodies.push(Body::default());
                if self.model.parts.insert(name(), self.part).is_some() {
                    return fail(format!("a second part `{}`; give each a name of its own", excerpt(name().as_bytes())));
                }
            }
            "INSTANCE" => {
                let part = keyword.get("PART").unwrap_or_default().to_uppercase();
                let Some(&part) = self.model.parts.get(&part) else {
                    return fail(format!("there is no part `{}`", excerpt(part.as_bytes())));
                };
                // An instance may add nodes and elements of its own.
                self.part = self.model.bodies.len();
                self.model.bodies.push(Body::default());
                self.model.instances.push(Instance::new([part, self.part]));
                self.section = Section::Instance(0);
            }
            "END PART" | "END INSTANCE" => self.part = 0,
            name if GENERATORS.contains(&name) => {
                return fail(format!("*{name} makes nodes or elements out of others, which is not supported; write them out"));
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads the file that a keyword names, if it is one of nodes or elements.
    fn include(&mut self, source: &Source, keyword: &Keyword, at: usize, deep: usize) -> Result<()> {
        let fail = |message: String| Err(source.error_line(at, message));
        let included = if keyword.name == "INCLUDE" || !matches!(self.section, Section::Other) { keyword.get("INPUT") } else { None };
        let Some(included) = included else { return Ok(()) };
        if deep == MOST_DEEP {
            return fail(format!("files lie more than {MOST_DEEP} deep within each other"));
        }
        match Source::open(&source.beside(included), "an Abaqus input file") {
            Ok(included) => self.file(&included, deep + 1),
            Err(error) => fail(format!("the file that it names cannot be read ({error})")),
        }
    }

    fn data(&mut self, source: &Source, line: &[u8], at: usize) -> Result<()> {
        let goes_on = line.ends_with(b",");
        let fields = line.strip_suffix(b",").unwrap_or(line).split(|&b| b == b',').map(<[u8]>::trim_ascii);
        let wrong = |field: &[u8], what: &str| source.error_line(at, format!("`{}` where {what} should be", excerpt(field)));
        match self.section {
            Section::Nodes => {
                let mut fields = fields;
                let tag = fields.next().unwrap_or_default();
                let tag = parse_integer(tag).ok_or_else(|| wrong(tag, "the number of a node"))?;
                let mut point = [0.0; 3];
                for (x, field) in point.iter_mut().zip(fields).filter(|(_, field)| !field.is_empty()) {
                    *x = float(field).ok_or_else(|| wrong(field, "a coordinate"))?;
                }
                let part = self.part;
                let body = &mut self.model.bodies[part];
                if self.twice == Some([part, body.tags.len()]) {
                    return Err(source.error_line(at, format!("node {tag} a second time, at another place; number it anew")));
                }
                body.tags.push(tag);
                body.points.push(point);
            }
            Section::Elements => {
                let mut pending = std::mem::take(&mut self.pending);
                let Some(block) = self.body().blocks.last_mut() else { return Ok(()) };
                if block.element.kind.is_none() {
                    block.count += usize::from(!goes_on);
                    return Ok(());
                }
                for field in fields {
                    pending.push(parse_integer(field).ok_or_else(|| wrong(field, "a number"))?);
                }
                let whole = 1 + block.element.nodes;
                if pending.len() > whole {
                    let (element, found, nodes) = (pending[0], pending.len() - 1, block.element.nodes);
                    return Err(source.error_line(at, format!("element {element} has {found} nodes, but its type has {nodes}")));
                }
                if pending.len() == whole {
                    block.add(&pending);
                    pending.clear();
                }
                self.pending = pending;
            }
            Section::Instance(lines) => {
                // What is left blank is 0.
                let numbers: Option<Vec<f64>> = fields.map(|field| if field.is_empty() { Some(0.0) } else { float(field) }).collect();
                let numbers = numbers.ok_or_else(|| wrong(line, "the place of an instance"))?;
                let instance = self.model.instances.last_mut();
                let right = instance.is_none_or(|instance| instance.place(lines, &numbers));
                if !right {
                    return Err(wrong(line, if lines == 0 { "a shift of three numbers" } else { "an axis and an angle, seven numbers," }));
                }
                self.section = Section::Instance(lines + 1);
            }
            Section::Other => {}
        }
        Ok(())
    }
}

/// Parses a number, whose exponent may be that of Fortran (`1.5D+02`).
fn float(field: &[u8]) -> Option<f64> {
    parse_float(field).or_else(|| {
        let text: Vec<u8> = field.iter().map(|&b| if b.eq_ignore_ascii_case(&b'd') { b'e' } else { b }).collect();
        parse_float(&text)
    })
}
