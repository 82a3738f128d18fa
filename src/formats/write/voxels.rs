//! Writer for voxel packages for 3D printers in the SVX format: a zip archive of a manifest and one picture per layer
//! and channel (<https://abfab3d.com/svx-format/>).

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::quiet::Quiet;
use super::{OutputFile, nameless, xml_attribute};
use crate::error::{Error, Result};

/// Description of a voxel package.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelPackage {
    /// Width, height, number of layers.
    pub size: [u32; 3],
    /// Lower corner of the first voxel in metres.
    pub origin: [f64; 3],
    /// Side length of a voxel in metres.
    pub voxel: f64,
    /// A second channel in addition to the density.
    pub channel: Option<Channel>,
    /// Metadata for the manifest: key and value.
    pub metadata: Vec<(String, String)>,
}

/// Content of the second channel, 8 bits per voxel.
#[derive(Clone, Debug, PartialEq)]
pub enum Channel {
    /// Numbers of materials, 0 for none. The list holds the numbers in use.
    Material(Vec<u8>),
    /// A field, scaled to 0…255.
    Custom,
}

/// Writes a package layer by layer.
pub struct VoxelWriter {
    package: VoxelPackage,
    path: std::path::PathBuf,
    zip: ZipWriter<Quiet<OutputFile>>,
    layer: u32,
}

impl VoxelWriter {
    /// Creates a package.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a size is 0 or the voxel size is not positive and finite, [`Error::Io`] if the file cannot
    /// be written.
    pub fn create(path: impl AsRef<Path>, package: VoxelPackage) -> Result<Self> {
        let path = path.as_ref();
        if package.size.contains(&0) || !(package.voxel > 0.0 && package.voxel.is_finite()) {
            return Err(Error::Invalid(format!("{}: voxels of size {} in a grid of {:?}", path.display(), package.voxel, package.size)));
        }
        Ok(Self { zip: ZipWriter::new(Quiet::new(OutputFile::create(path)?)), path: path.into(), package, layer: 0 })
    }

    fn fail(&self, source: impl Into<std::io::Error>) -> Error {
        Error::Io { path: self.path.clone(), source: nameless(source.into()) }
    }

    fn entry(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored).large_file(false);
        self.zip.start_file(name, options).map_err(|e| self.fail(e))?;
        self.zip.write_all(bytes).map_err(|e| self.fail(e))
    }

    /// Appends a layer, row 0 first: density (255 material, 0 none) and, if the package has one, the second channel.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the number of voxels is wrong, [`Error::Io`] if the file cannot be written.
    pub fn layer(&mut self, density: &[u8], second: Option<&[u8]>) -> Result<()> {
        let [width, height, layers] = self.package.size;
        let voxels = width as usize * height as usize;
        let wrong =
            density.len() != voxels || second.is_some_and(|s| s.len() != voxels) || second.is_some() != self.package.channel.is_some();
        if wrong || self.layer >= layers {
            return Err(Error::Invalid(format!("{}: layer {} does not fit {:?}", self.path.display(), self.layer, self.package.size)));
        }
        let folder = self.folder();
        for (folder, channel) in [("density", Some(density)), (folder, second)] {
            if let Some(voxels) = channel {
                let picture = grey(width, height, voxels).map_err(|e| self.fail(e))?;
                let name = format!("{folder}/slice{:05}.png", self.layer);
                self.entry(&name, &picture)?;
            }
        }
        self.layer += 1;
        Ok(())
    }

    fn folder(&self) -> &'static str {
        if matches!(self.package.channel, Some(Channel::Material(_))) { "material" } else { "value" }
    }

    /// Writes the manifest and completes the file.
    ///
    /// # Errors
    /// [`Error::Invalid`] if layers are missing, [`Error::Io`] if the file cannot be written.
    pub fn finish(mut self) -> Result<()> {
        let VoxelPackage { size: [x, y, z], origin: [ox, oy, oz], voxel, .. } = self.package;
        if self.layer != z {
            return Err(Error::Invalid(format!("{}: {} of {z} layers were written", self.path.display(), self.layer)));
        }
        let mut xml = format!(
            "<?xml version=\"1.0\"?>\n<grid version=\"1.0\" gridSizeX=\"{x}\" gridSizeY=\"{y}\" gridSizeZ=\"{z}\" originX=\"{ox}\" originY=\"{oy}\" originZ=\"{oz}\" voxelSize=\"{voxel}\" subvoxelBits=\"8\" slicesOrientation=\"Z\">\n<channels>\n<channel type=\"DENSITY\" bits=\"8\" slices=\"density/slice%05d.png\"/>\n"
        );
        let kind = match &self.package.channel {
            Some(Channel::Material(_)) => Some("MATERIAL"),
            Some(Channel::Custom) => Some("CUSTOM"),
            None => None,
        };
        if let Some(kind) = kind {
            let _ = writeln!(xml, "<channel type=\"{kind}\" bits=\"8\" slices=\"{}/slice%05d.png\"/>", self.folder());
        }
        xml += "</channels>\n";
        if let Some(Channel::Material(ids)) = &self.package.channel {
            xml += "<materials>\n";
            for id in ids {
                let _ = writeln!(xml, "<material id=\"{id}\" urn=\"urn:olbvh:material:{id}\"/>");
            }
            xml += "</materials>\n";
        }
        xml += "<metadata>\n";
        for (key, value) in &self.package.metadata {
            let _ = writeln!(xml, "<entry key=\"{}\" value=\"{}\"/>", xml_attribute(key), xml_attribute(value));
        }
        xml += "</metadata>\n</grid>\n";
        self.entry("manifest.xml", xml.as_bytes())?;
        let path = self.path.clone();
        self.zip.finish().map_err(Into::into).and_then(Quiet::into_inner).map_err(|e| Error::Io { path, source: nameless(e) })?.commit()
    }
}

/// Encodes a grey picture with row 0 at the top, which is how the tools of the format number rows.
fn grey(width: u32, height: u32, voxels: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(voxels)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read as _;

    #[test]
    fn a_package_has_a_manifest_and_a_picture_per_layer() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svx");
        let package = VoxelPackage {
            size: [3, 2, 2],
            origin: [0.0; 3],
            voxel: 1e-4,
            channel: Some(Channel::Material(vec![1, 2])),
            metadata: vec![("field".into(), "<a & b>".into())],
        };
        let mut writer = VoxelWriter::create(&path, package.clone()).unwrap();
        assert!(writer.layer(&[0; 5], Some(&[0; 5])).is_err() && writer.layer(&[0; 6], None).is_err());
        for k in 0..2 {
            assert!(!path.exists());
            writer.layer(&[255, 0, 0, 255, 255, k], Some(&[1, 0, 0, 2, 2, 0])).unwrap();
        }
        assert!(writer.layer(&[0; 6], Some(&[0; 6])).is_err());
        writer.finish().unwrap();
        let mut zip = zip::ZipArchive::new(std::fs::File::open(&path).unwrap()).unwrap();
        let mut xml = String::new();
        zip.by_name("manifest.xml").unwrap().read_to_string(&mut xml).unwrap();
        assert!(xml.contains("gridSizeZ=\"2\"") && xml.contains("voxelSize=\"0.0001\"") && xml.contains("&lt;a &amp; b&gt;"), "{xml}");
        let mut png = Vec::new();
        zip.by_name("density/slice00001.png").unwrap().read_to_end(&mut png).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut pixels = vec![0; 6];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [255, 0, 0, 255, 255, 1]);
        assert_eq!(zip.len(), 5);
        // A package that is dropped before it is complete leaves no file.
        let other = folder.path().join("b.svx");
        drop(VoxelWriter::create(&other, package).unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
