//! Writer for pictures.

use std::io::Write as _;
use std::path::Path;

use super::write_file;
use crate::error::{Error, Result};

/// Writes a PNG of 8-bit RGBA pixels, row by row from the top.
///
/// # Errors
/// [`Error::Invalid`] if the number of pixels does not match the size, [`Error::Io`] if the file cannot be written.
pub fn write_png(path: impl AsRef<Path>, width: u32, height: u32, rgba: &[u8]) -> Result<()> {
    let path = path.as_ref();
    if rgba.len() as u64 != 4 * u64::from(width) * u64::from(height) || rgba.is_empty() {
        return Err(Error::Invalid(format!("{}: {} bytes for a picture of {width}×{height}", path.display(), rgba.len())));
    }
    write_file(path, |file| {
        let mut encoder = png::Encoder::new(&mut *file, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(rgba)?;
        writer.finish()?;
        file.flush()
    })
}
