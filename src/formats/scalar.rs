//! Number types of binary data and their conversion.

/// A number type as stored in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// A type that stored numbers are converted to.
pub(crate) trait Number: Copy {
    /// Whether the type holds whole numbers only, so that fractions are invalid.
    const EXACT: bool = false;
    fn from_i64(v: i64) -> Self;
    fn from_u64(v: u64) -> Self;
    fn from_f64(v: f64) -> Self;
}

impl Number for f64 {
    fn from_i64(v: i64) -> Self {
        v as f64
    }
    fn from_u64(v: u64) -> Self {
        v as f64
    }
    fn from_f64(v: f64) -> Self {
        v
    }
}

impl Number for f32 {
    fn from_i64(v: i64) -> Self {
        v as f32
    }
    fn from_u64(v: u64) -> Self {
        v as f32
    }
    fn from_f64(v: f64) -> Self {
        v as f32
    }
}

/// Used for indices: a number that does not fit becomes `i64::MAX`, which no index equals.
impl Number for i64 {
    const EXACT: bool = true;
    fn from_i64(v: i64) -> Self {
        v
    }
    fn from_u64(v: u64) -> Self {
        i64::try_from(v).unwrap_or(i64::MAX)
    }
    fn from_f64(v: f64) -> Self {
        if v.fract() == 0.0 && v.abs() < 9e15 { v as i64 } else { i64::MAX }
    }
}

impl Scalar {
    pub const fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::I64 | Scalar::U64 | Scalar::F64 => 8,
        }
    }

    pub const fn is_float(self) -> bool {
        matches!(self, Scalar::F32 | Scalar::F64)
    }

    /// The type with this name in VTK XML files.
    pub fn vtk_xml(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Scalar::I8,
            "UInt8" => Scalar::U8,
            "Int16" => Scalar::I16,
            "UInt16" => Scalar::U16,
            "Int32" => Scalar::I32,
            "UInt32" => Scalar::U32,
            "Int64" => Scalar::I64,
            "UInt64" => Scalar::U64,
            "Float32" => Scalar::F32,
            "Float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// The type with this name, in lower case, in legacy VTK files.
    pub fn vtk_legacy(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "signed_char" | "vtktypeint8" => Scalar::I8,
            "unsigned_char" | "vtktypeuint8" => Scalar::U8,
            "short" | "vtktypeint16" => Scalar::I16,
            "unsigned_short" | "vtktypeuint16" => Scalar::U16,
            "int" | "vtktypeint32" | "vtkidtype" => Scalar::I32,
            "unsigned_int" | "vtktypeuint32" => Scalar::U32,
            "long" | "vtktypeint64" => Scalar::I64,
            "unsigned_long" | "vtktypeuint64" => Scalar::U64,
            "float" => Scalar::F32,
            "double" => Scalar::F64,
            _ => return None,
        })
    }

    /// The type with this name in PLY files.
    pub fn ply(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// Converts stored numbers; a remainder shorter than one number is left out.
    pub fn convert<T: Number>(self, bytes: &[u8], big: bool) -> Vec<T> {
        let mut values = Vec::with_capacity(bytes.len() / self.size());
        self.convert_to(&mut values, bytes, big);
        values
    }

    /// Converts a stored number; `None` if there are too few bytes.
    pub fn one<T: Number>(self, bytes: &[u8], big: bool) -> Option<T> {
        let mut last = Last(None);
        self.extend::<T, _>(&mut last, bytes, big);
        last.0
    }

    /// Converts stored numbers as [`Self::convert`] does, and appends them to `values`.
    pub fn convert_to<T: Number>(self, values: &mut Vec<T>, bytes: &[u8], big: bool) {
        self.extend::<T, _>(values, bytes, big);
    }

    fn extend<T: Number, E: Extend<T>>(self, values: &mut E, bytes: &[u8], big: bool) {
        macro_rules! numbers {
            ($type:ty, $from:ident, $wide:ty) => {{
                const SIZE: usize = size_of::<$type>();
                let chunks = bytes.chunks_exact(SIZE).map(|chunk| {
                    let mut word = [0; SIZE];
                    word.copy_from_slice(chunk);
                    word
                });
                if big {
                    values.extend(chunks.map(|word| T::$from(<$wide>::from(<$type>::from_be_bytes(word)))));
                } else {
                    values.extend(chunks.map(|word| T::$from(<$wide>::from(<$type>::from_le_bytes(word)))));
                }
            }};
        }
        match self {
            Scalar::I8 => numbers!(i8, from_i64, i64),
            Scalar::U8 => numbers!(u8, from_i64, i64),
            Scalar::I16 => numbers!(i16, from_i64, i64),
            Scalar::U16 => numbers!(u16, from_i64, i64),
            Scalar::I32 => numbers!(i32, from_i64, i64),
            Scalar::U32 => numbers!(u32, from_i64, i64),
            Scalar::I64 => numbers!(i64, from_i64, i64),
            Scalar::U64 => numbers!(u64, from_u64, u64),
            Scalar::F32 => numbers!(f32, from_f64, f64),
            Scalar::F64 => numbers!(f64, from_f64, f64),
        }
    }
}

/// Keeps the last of the values that it is extended by.
struct Last<T>(Option<T>);

impl<T> Extend<T> for Last<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, values: I) {
        self.0 = values.into_iter().last().or(self.0.take());
    }
}
