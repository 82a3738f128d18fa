//! What a shader module declares, read from its SPIR-V with rspirv.

use rspirv::dr::{Instruction, Module, Operand, load_words};
use rspirv::spirv::{Decoration, Op, StorageClass, Word};
use std::collections::HashMap;

/// A kernel's interface.
#[derive(Clone)]
pub struct Interface {
    pub stem: String,
    pub buffers: Vec<Buffer>,
    pub scalars: Vec<Member>,
    pub scalar_bytes: u32,
    pub constants: Vec<Constant>,
}

#[derive(Clone)]
pub struct Buffer {
    pub name: String,
    pub reads: bool,
    pub writes: bool,
    /// Its address must be a multiple of this.
    pub alignment: u32,
}

#[derive(Clone)]
pub struct Member {
    pub name: String,
    pub rust_type: String,
    pub offset: u32,
}

#[derive(Clone)]
pub struct Constant {
    pub name: String,
    pub id: u32,
    pub default: u32,
}

pub struct StructLayout {
    pub bytes: u32,
    pub members: Vec<Member>,
}

struct Reader {
    module: Module,
    names: HashMap<Word, String>,
    member_names: HashMap<(Word, u32), String>,
    types: HashMap<Word, Instruction>,
}

impl Reader {
    fn new(words: &[u32]) -> Result<Self, String> {
        let module = load_words(words).map_err(|e| format!("cannot parse SPIR-V: {e:?}"))?;
        let (mut names, mut member_names, mut types) = (HashMap::new(), HashMap::new(), HashMap::new());
        for i in &module.debug_names {
            match (i.class.opcode, i.operands.as_slice()) {
                (Op::Name, [Operand::IdRef(id), Operand::LiteralString(s)]) => drop(names.insert(*id, s.clone())),
                (Op::MemberName, [Operand::IdRef(id), Operand::LiteralBit32(m), Operand::LiteralString(s)]) => {
                    member_names.insert((*id, *m), s.clone());
                }
                _ => {}
            }
        }
        for i in &module.types_global_values {
            if let Some(id) = i.result_id {
                types.insert(id, i.clone());
            }
        }
        Ok(Self { module, names, member_names, types })
    }

    fn decoration(&self, target: Word, wanted: Decoration) -> Option<u32> {
        self.module.annotations.iter().find_map(|i| match i.operands.as_slice() {
            [Operand::IdRef(id), Operand::Decoration(d), rest @ ..] if *id == target && *d == wanted => match rest {
                [Operand::LiteralBit32(v), ..] => Some(*v),
                _ => Some(0),
            },
            _ => None,
        })
    }

    fn member_decoration(&self, target: Word, member: u32, wanted: Decoration) -> Option<u32> {
        self.module.annotations.iter().find_map(|i| match i.operands.as_slice() {
            [Operand::IdRef(id), Operand::LiteralBit32(m), Operand::Decoration(d), rest @ ..]
                if *id == target && *m == member && *d == wanted =>
            {
                match rest {
                    [Operand::LiteralBit32(v), ..] => Some(*v),
                    _ => Some(0),
                }
            }
            _ => None,
        })
    }

    fn operand_id(&self, id: Word, n: usize) -> Result<Word, String> {
        match self.types.get(&id).and_then(|i| i.operands.get(n)) {
            Some(Operand::IdRef(v)) => Ok(*v),
            _ => Err(format!("unexpected operand {n} of %{id}")),
        }
    }

    /// Rust type and size in bytes.
    fn rust_type(&self, id: Word) -> Result<(String, u32), String> {
        let i = self.types.get(&id).ok_or_else(|| format!("unknown type %{id}"))?;
        let literal = |n: usize| match i.operands.get(n) {
            Some(Operand::LiteralBit32(v)) => *v,
            _ => 0,
        };
        match i.class.opcode {
            Op::TypeInt => Ok((if literal(1) == 1 { "i32" } else { "u32" }.into(), 4)),
            Op::TypeFloat => Ok(("f32".into(), 4)),
            Op::TypeVector => {
                let (inner, bytes) = self.rust_type(self.operand_id(id, 0)?)?;
                let n = literal(1);
                if n == 3 {
                    return Err("three-component vectors have different layouts on host and device: use four".into());
                }
                Ok((format!("[{inner}; {n}]"), bytes * n))
            }
            Op::TypeArray => {
                let (inner, bytes) = self.rust_type(self.operand_id(id, 0)?)?;
                let length = self.operand_id(id, 1)?;
                let n = match self.types.get(&length).and_then(|c| c.operands.first()) {
                    Some(Operand::LiteralBit32(v)) => *v,
                    _ => return Err("array length is no constant".into()),
                };
                if self.decoration(id, Decoration::ArrayStride) != Some(bytes) {
                    return Err("array with padded elements".into());
                }
                Ok((format!("[{inner}; {n}]"), bytes * n))
            }
            Op::TypeStruct => {
                let members = self.members(id)?;
                let last = members.last().ok_or("empty struct")?;
                let last_id = self.operand_id(id, members.len() - 1)?;
                let bytes = last.offset + self.rust_type(last_id)?.1;
                Ok((self.names.get(&id).cloned().unwrap_or_default(), bytes))
            }
            other => Err(format!("{other:?} cannot be shared with the host")),
        }
    }

    fn members(&self, id: Word) -> Result<Vec<Member>, String> {
        let i = self.types.get(&id).ok_or("unknown struct")?;
        let mut members = Vec::new();
        for n in 0..i.operands.len() as u32 {
            let name = self.member_names.get(&(id, n)).cloned().unwrap_or_default();
            let offset = self.member_decoration(id, n, Decoration::Offset).unwrap_or(0);
            let rust_type = self.rust_type(self.operand_id(id, n as usize)?).map_err(|e| format!("{name}: {e}"))?.0;
            members.push(Member { name, rust_type, offset });
        }
        Ok(members)
    }

    /// The variables of a storage class: (variable, pointee).
    fn variables(&self, wanted: StorageClass) -> Vec<(Word, Word)> {
        let variables = self.module.types_global_values.iter().filter(|i| i.class.opcode == Op::Variable);
        variables
            .filter_map(|i| match i.operands.first() {
                Some(Operand::StorageClass(c)) if *c == wanted => Some((i.result_id?, self.operand_id(i.result_type?, 1).ok()?)),
                _ => None,
            })
            .collect()
    }
}

/// The interface of a kernel, from its unoptimised descriptor form.
pub fn interface(words: &[u32], stem: &str) -> Result<Interface, String> {
    let r = Reader::new(words)?;
    let mut buffers = Vec::new();
    for (variable, block) in r.variables(StorageClass::StorageBuffer) {
        let binding = r.decoration(variable, Decoration::Binding).ok_or("buffer without binding")?;
        let flag = |d| r.member_decoration(block, 0, d).is_some() || r.decoration(variable, d).is_some();
        let name = r.names.get(&variable).cloned().unwrap_or_default();
        let block_name = r.names.get(&block).map_or("", String::as_str);
        let alignment = block_name.rsplit("Block").next().and_then(|a| a.parse().ok()).ok_or(format!("buffer {name} has no alignment"))?;
        let (reads, writes) = (!flag(Decoration::NonReadable), !flag(Decoration::NonWritable));
        buffers.push((binding, Buffer { name, reads, writes, alignment }));
    }
    buffers.sort_by_key(|(binding, _)| *binding);
    if buffers.iter().enumerate().any(|(i, (binding, _))| *binding != i as u32) {
        return Err(format!("buffers must use the bindings 0 to {} each once", buffers.len() - 1));
    }
    let (mut scalars, mut scalar_bytes) = (Vec::new(), 0);
    if let Some((_, block)) = r.variables(StorageClass::PushConstant).first() {
        scalars = r.members(*block)?;
        scalar_bytes = r.rust_type(*block)?.1;
    }
    let mut constants = Vec::new();
    for i in &r.module.types_global_values {
        let Some(id) = i.result_id else { continue };
        let (Op::SpecConstant, Some(spec)) = (i.class.opcode, r.decoration(id, Decoration::SpecId)) else { continue };
        let Some(Operand::LiteralBit32(default)) = i.operands.first() else { continue };
        // The workgroup size is a constant that has no name if the source does not use it otherwise.
        let name = r.names.get(&id).cloned().unwrap_or_else(|| "WORKGROUP".into());
        constants.push(Constant { name, id: spec, default: *default });
    }
    constants.sort_by_key(|c| c.id);
    constants.dedup_by_key(|c| c.id);
    let bytes = 8 * buffers.len() as u32 + scalar_bytes;
    if bytes > 128 {
        return Err(format!("{bytes} bytes of arguments; 128 are guaranteed"));
    }
    Ok(Interface { stem: stem.into(), buffers: buffers.into_iter().map(|(_, b)| b).collect(), scalars, scalar_bytes, constants })
}

/// The layout of a struct of a module.
pub fn layout_of(words: &[u32], name: &str) -> Result<StructLayout, String> {
    let r = Reader::new(words)?;
    let laid_out = |id: &Word| r.member_decoration(*id, 0, Decoration::Offset).is_some();
    let found = r.names.iter().find(|(id, n)| n.as_str() == name && laid_out(id));
    let (id, _) = found.ok_or_else(|| format!("struct {name} is not in the module"))?;
    let bytes = r.rust_type(*id)?.1.next_multiple_of(4);
    Ok(StructLayout { bytes, members: r.members(*id).map_err(|e| format!("{name}.{e}"))? })
}

/// The names of the structs of a source.
pub fn struct_names(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| line.strip_prefix("struct ")?.split_whitespace().next())
}

/// The comments of a source, by `Struct` (the lines before it) and `Struct.member` (after it on its line).
pub fn comments(text: &str) -> HashMap<String, String> {
    let (mut found, mut above, mut inside) = (HashMap::new(), Vec::new(), String::new());
    for line in text.lines().map(str::trim) {
        if let Some(comment) = line.strip_prefix("//") {
            above.push(comment.trim().to_string());
        } else if let Some(rest) = line.strip_prefix("struct ") {
            inside = rest.split_whitespace().next().unwrap_or_default().to_string();
            found.insert(inside.clone(), above.join(" "));
            above.clear();
        } else {
            if let (Some((code, comment)), false) = (line.split_once("//"), inside.is_empty()) {
                let member = code.trim().trim_end_matches(';').split_whitespace().last().unwrap_or_default();
                let member = member.split('[').next().unwrap_or_default();
                found.insert(format!("{inside}.{member}"), comment.trim().to_string());
            }
            if line.starts_with('}') {
                inside.clear();
            }
            above.clear();
        }
    }
    found
}
