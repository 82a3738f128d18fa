//! Decompression of the compressors that VTK uses, one block at a time and never beyond the announced size.

use std::io::Read;

use flate2::{Decompress, FlushDecompress, Status};

/// A compressor of VTK XML files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compressor {
    Zlib,
    Lz4,
    Xz,
}

impl Compressor {
    pub const fn name(self) -> &'static str {
        match self {
            Compressor::Zlib => "zlib",
            Compressor::Lz4 => "lz4",
            Compressor::Xz => "lzma",
        }
    }

    /// Decompresses a block, which must fill `out` exactly.
    pub fn unpack(self, packed: &[u8], out: &mut [u8]) -> Result<(), String> {
        match self {
            Compressor::Zlib => zlib(packed, out),
            Compressor::Lz4 => match lz4_flex::block::decompress_into(packed, out) {
                Ok(n) if n == out.len() => Ok(()),
                Ok(n) => Err(format!("it unpacks to {n} bytes instead of {}", out.len())),
                Err(error) => Err(error.to_string()),
            },
            Compressor::Xz => xz(packed, out),
        }
    }
}

fn zlib(packed: &[u8], out: &mut [u8]) -> Result<(), String> {
    let mut stream = Decompress::new(true);
    let status = stream.decompress(packed, out, FlushDecompress::Finish).map_err(|e| e.to_string())?;
    let full = stream.total_out() == out.len() as u64;
    match status {
        Status::StreamEnd if full => Ok(()),
        Status::StreamEnd => Err(format!("it unpacks to {} bytes instead of {}", stream.total_out(), out.len())),
        _ if full => Err(format!("it unpacks to more than {} bytes", out.len())),
        _ => Err("its data end early".into()),
    }
}

/// Memory limit for xz in KiB: enough for the dictionaries of its highest level, the largest that VTK writes.
const XZ_MEMORY: u32 = 66 << 10;

fn xz(packed: &[u8], out: &mut [u8]) -> Result<(), String> {
    let mut reader = lzma_rust2::XzReader::new_mem_limit(packed, false, XZ_MEMORY);
    reader.read_exact(out).map_err(|e| e.to_string())?;
    match reader.read(&mut [0]) {
        Ok(0) => Ok(()),
        Ok(_) => Err(format!("it unpacks to more than {} bytes", out.len())),
        Err(error) => Err(error.to_string()),
    }
}
