//! The XML of a VTK file without the contents of its arrays, which stay on disk.

use std::ops::Range;

use super::super::source::Source;
use super::super::tokens::Tokens;
use crate::error::Result;
use memchr::{memchr, memchr2, memchr3};

/// What an XML file has up to its appended data, without the text of arrays.
pub(crate) struct Outline {
    /// The XML. If it is not UTF-8, non-ASCII bytes are question marks, so that a name in another encoding does no harm.
    pub text: String,
    cuts: Vec<Cut>,
}

/// Text that was left out.
struct Cut {
    /// Where it would be in the outline.
    at: usize,
    /// Where it is in the file.
    range: Range<usize>,
}

/// A tag, comment or the like.
enum Tag {
    /// The start of the root `VTKFile`.
    Root,
    /// The start of an array with contents.
    Array,
    /// The start of appended data with contents.
    Appended,
    /// The start or end of another element, or an empty element.
    Element,
    /// A comment, declaration or the like.
    Markup,
}

impl Outline {
    pub fn read(source: &Source) -> Result<Self> {
        let (mut bytes, mut cuts) = (Vec::new(), Vec::new());
        let (mut tokens, mut begin, mut has_root) = (Tokens::new(source, None), 0, false);
        while let Some(tag) = next_tag(&mut tokens)? {
            match tag {
                Tag::Root => has_root = true,
                Tag::Markup => {}
                // The parser needs no more to refuse a file with another root.
                _ if !has_root => break,
                Tag::Array => {
                    bytes.extend_from_slice(&tokens.since(begin)?);
                    begin = tokens.at;
                    // A reference in the data is kept, for the parser to refuse.
                    if tokens.skip_until(|bytes| memchr2(b'<', b'&', bytes))? == Some(b'<') {
                        cuts.push(Cut { at: bytes.len(), range: begin..tokens.at });
                        begin = tokens.at;
                    }
                }
                Tag::Appended => break,
                Tag::Element => {}
            }
        }
        bytes.extend_from_slice(&tokens.since(begin)?);
        let ascii = |&b: &u8| if b.is_ascii() { char::from(b) } else { '?' };
        let text = String::from_utf8(bytes).unwrap_or_else(|error| error.as_bytes().iter().map(ascii).collect());
        Ok(Self { text, cuts })
    }

    /// Position in the file of byte `at` of the text.
    pub fn in_file(&self, at: usize) -> usize {
        let before = self.cuts[..self.cuts.partition_point(|cut| cut.at <= at)].last();
        before.map_or(at, |cut| cut.range.end + (at - cut.at))
    }

    /// Where in the file the contents are that were left out before byte `at` of the text; `None` if none were.
    pub fn cut_at(&self, at: usize) -> Option<Range<usize>> {
        self.cuts.binary_search_by_key(&at, |cut| cut.at).ok().map(|found| self.cuts[found].range.clone())
    }
}

/// Moves behind the next tag, comment or the like; `None` at the end of the file. Whether the XML is well-formed is not
/// checked here.
fn next_tag(tokens: &mut Tokens<'_>) -> Result<Option<Tag>> {
    if tokens.skip_until(|bytes| memchr(b'<', bytes))?.is_none() {
        return Ok(None);
    }
    for (begin, end) in [(&b"<!--"[..], &b"-->"[..]), (b"<![CDATA[", b"]]>"), (b"<?", b"?>")] {
        if tokens.starts_with(begin)? {
            tokens.at += begin.len();
            return Ok(tokens.skip_past(end)?.then_some(Tag::Markup));
        }
    }
    let mut tag = Tag::Element;
    for (begin, kind) in
        [(&b"<VTKFile"[..], Tag::Root), (b"<DataArray", Tag::Array), (b"<AppendedData", Tag::Appended), (b"<!", Tag::Markup)]
    {
        if tokens.starts_with(begin)? {
            tag = kind;
        }
    }
    // A > in quotation marks does not end a tag.
    while let Some(stop) = tokens.skip_until(|bytes| memchr3(b'>', b'"', b'\'', bytes))? {
        let is_empty = stop == b'>' && *tokens.since(tokens.at - 1)? == *b"/";
        tokens.at += 1;
        if stop == b'>' {
            return Ok(Some(if is_empty { Tag::Element } else { tag }));
        }
        if tokens.skip_until(|bytes| memchr(stop, bytes))?.is_none() {
            break;
        }
        tokens.at += 1;
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_text_of_arrays_is_left_out() {
        let xml = "<?xml it's?><!-- <DataArray> --><VTKFile a='>'><DataArray b=\"/>\">1 2\n</DataArray><DataArray/> x \
                   <DataArray>&lt;</DataArray><![CDATA[<DataArray>]]><DataArray><!-- 4 --> 5</DataArray><AppendedData c='d'>_<DataArray>6";
        let source = Source::new("none".as_ref(), xml.as_bytes().to_vec());
        let outline = Outline::read(&source).unwrap();
        let text = &outline.text;
        assert_eq!(*text, xml.replace("1 2\n", "").replace("_<DataArray>6", ""));
        let first = text.find("</DataArray>").unwrap();
        assert_eq!(outline.cut_at(first), Some(first..first + 4));
        assert_eq!([first - 1, first, first + 9].map(|at| outline.in_file(at)), [first - 1, first + 4, first + 13]);
        assert_eq!(outline.in_file(text.len()), xml.find("_<").unwrap());
        for broken in ["", "no XML", "<V", "<V a='", "<!-- ", "<VTKFile><DataArray>1 2", "<V\"<AppendedData>"] {
            let source = Source::new("none".as_ref(), broken.as_bytes().to_vec());
            assert_eq!(Outline::read(&source).unwrap().text, broken);
        }
    }

    #[test]
    fn only_empty_appended_data_have_xml_behind_them() {
        for (xml, end) in [("<VTKFile><AppendedData a='/'>_ </VTKFile>", 29), ("<VTKFile><AppendedData/> </VTKFile>", 35)] {
            let source = Source::new("none".as_ref(), xml.as_bytes().to_vec());
            assert_eq!(Outline::read(&source).unwrap().text, xml[..end]);
        }
    }

    /// The root tells whether to go on.
    #[test]
    fn nothing_is_read_behind_another_root() {
        for root in ["<b/>", "<b c='>'>", "</b>", "<DataArray>", "<DataArray/>", "<AppendedData>"] {
            let start = format!("<?xml?><!-- <a> --><!DOCTYPE x> {root}");
            let source = Source::new("none".as_ref(), format!("{start} <VTKFile>").into_bytes());
            assert_eq!(Outline::read(&source).unwrap().text, start);
        }
    }
}
