//! Output of the layers of `olbvh slice`: arrays, an image for `ParaView`, pictures, or a package of voxels.

use super::output;
use super::slice_placement::Placement;
use olbvh::error::{Error, Result};
use olbvh::formats::{Channel, OutputFormat, SliceGrid, SliceWriter, VoxelPackage, VoxelWriter, write_png};
use olbvh::mesh::{Field, Mesh, On};
use olbvh::render::TransferFunction;
use olbvh::slicing::{Band, EMPTY};
use std::path::{Path, PathBuf};

/// How values are shown in pictures and packages.
pub struct Appearance {
    /// Colour map over the range.
    pub colors: TransferFunction,
    /// Values at the two ends of the range.
    pub range: [f32; 2],
    /// Metres per unit of the mesh.
    pub unit: f64,
    /// Name of the field, if there is one.
    pub field: Option<String>,
    /// For packages: the materials that the field numbers, if it does.
    pub materials: Option<Vec<u8>>,
}

/// The materials that a field numbers, if every cell has a whole number from 1 to 255.
pub fn materials(field: &Field) -> Option<Vec<u8>> {
    let number = |&v: &f32| (v.fract() == 0.0 && (1.0..=255.0).contains(&v)).then_some(v as u8);
    let all: Option<std::collections::BTreeSet<u8>> = field.values.iter().map(number).collect();
    all.filter(|_| field.on == On::Cells).map(|all| all.into_iter().collect())
}

impl Appearance {
    /// Position of a value in the range, from 0 to 1.
    fn place(&self, value: f32) -> f32 {
        let [lo, hi] = self.range;
        if hi > lo && value.is_finite() { ((value - lo) / (hi - lo)).clamp(0.0, 1.0) } else { 0.5 }
    }
}

enum Target {
    Arrays(Box<SliceWriter>),
    Pictures(PathBuf),
    Package(Box<VoxelWriter>),
}

/// Collects bands into layers and writes these one by one.
pub struct Layers<'a> {
    target: Target,
    mesh: &'a Mesh,
    size: [u32; 2],
    count: u32,
    done: u32,
    owners: bool,
    look: Appearance,
    pending: Band,
}

impl<'a> Layers<'a> {
    /// Creates the output for voxels that are placed like this.
    pub fn create(
        path: &Path,
        format: OutputFormat,
        placement: &Placement,
        mesh: &'a Mesh,
        owners: bool,
        look: Appearance,
    ) -> Result<Self> {
        let Placement { size, origin, spacing, axes, .. } = *placement;
        let [w, h, count] = size;
        let target = match format {
            OutputFormat::Png => Target::Pictures(path.into()),
            OutputFormat::Svx => {
                let along = |axis: [f64; 3]| (0..3).map(|c| axis[c] * origin[c]).sum::<f64>();
                let corner = [0, 1, 2].map(|i| (along(axes[i]) - spacing[0] * 0.5) * look.unit);
                let channel = look.field.as_ref().map(|_| look.materials.clone().map_or(Channel::Custom, Channel::Material));
                let mut metadata = vec![("creator".into(), concat!("olbvh ", env!("CARGO_PKG_VERSION")).into())];
                if let Some(name) = &look.field {
                    metadata.push(("field".into(), name.clone()));
                    if look.materials.is_none() {
                        metadata.push(("range".into(), format!("{} {}", look.range[0], look.range[1])));
                    }
                }
                let package = VoxelPackage { size, origin: corner, voxel: spacing[0] * look.unit, channel, metadata };
                Target::Package(Box::new(VoxelWriter::create(path, package)?))
            }
            _ => Target::Arrays(Box::new(SliceWriter::create(path, SliceGrid { size, origin, spacing, axes }, owners)?)),
        };
        Ok(Self { target, mesh, size: [w, h], count, done: 0, owners, look, pending: Band::default() })
    }

    /// Adds a band, and writes the layers that are complete.
    pub fn band(&mut self, band: Band) -> Result<()> {
        let all = &mut self.pending;
        if all.kinds.is_empty() {
            *all = band;
        } else {
            all.values.extend(band.values);
            all.kinds.extend(band.kinds);
            all.owners.extend(band.owners);
        }
        let voxels = self.size[0] as usize * self.size[1] as usize;
        let whole = self.pending.kinds.len() / voxels;
        let all = std::mem::take(&mut self.pending);
        for i in 0..whole {
            let part = i * voxels..(i + 1) * voxels;
            self.layer(&all.values[part.clone()], &all.kinds[part.clone()], &all.owners[part])?;
        }
        let rest = whole * voxels;
        if rest < all.kinds.len() {
            self.pending = if rest == 0 {
                all
            } else {
                Band { values: all.values[rest..].to_vec(), kinds: all.kinds[rest..].to_vec(), owners: all.owners[rest..].to_vec(), ..all }
            };
        }
        Ok(())
    }

    fn layer(&mut self, values: &[f32], kinds: &[u8], owners: &[u32]) -> Result<()> {
        let [w, h] = self.size;
        match &mut self.target {
            Target::Arrays(writer) => {
                let cells: Option<Vec<u32>> =
                    self.owners.then(|| owners.iter().map(|&t| if t == u32::MAX { t } else { self.mesh.cell_id(t) }).collect());
                writer.layer(values, kinds, cells.as_deref())?;
            }
            Target::Pictures(path) => {
                let path = layer_file(path, self.done, self.count);
                let pixel = |i: usize| -> [u8; 4] {
                    if kinds[i] == EMPTY {
                        return [0; 4];
                    }
                    let color = if self.look.field.is_some() { self.look.colors.at(self.look.place(values[i])) } else { [0.6; 4] };
                    let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
                    [byte(color[0]), byte(color[1]), byte(color[2]), 255]
                };
                let (w, h) = (w as usize, h as usize);
                let pixels: Vec<u8> = (0..h).rev().flat_map(|y| (0..w).flat_map(move |x| pixel(y * w + x))).collect();
                output::begin(&path);
                write_png(path, w as u32, h as u32, &pixels)?;
            }
            Target::Package(writer) => {
                let density: Vec<u8> = kinds.iter().map(|&k| if k == EMPTY { 0 } else { 255 }).collect();
                let look = &self.look;
                let second = look.field.as_ref().map(|_| -> Vec<u8> {
                    let byte = |(&k, &v): (&u8, &f32)| match k {
                        EMPTY => 0,
                        _ if look.materials.is_some() => v as u8,
                        _ => (look.place(v) * 255.0).round() as u8,
                    };
                    kinds.iter().zip(values).map(byte).collect()
                });
                writer.layer(&density, second.as_deref())?;
            }
        }
        self.done += 1;
        Ok(())
    }

    /// Completes the output.
    pub fn finish(self) -> Result<()> {
        if self.done != self.count {
            return Err(Error::Invalid(format!("{} of {} layers were sliced", self.done, self.count)));
        }
        match self.target {
            Target::Arrays(writer) => writer.finish(),
            Target::Pictures(_) => Ok(()),
            Target::Package(writer) => writer.finish(),
        }
    }
}

/// The picture of layer `i` of `count`, for example `NAME-0007.png`; a single layer has no number. All numbers have as
/// many digits as the largest one, so that the files sort in the order of the layers.
pub fn layer_file(path: &Path, i: u32, count: u32) -> PathBuf {
    if count == 1 {
        return path.to_path_buf();
    }
    let digits = (count - 1).to_string().len().max(4);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{i:0digits$}.png"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_layers_sort() {
        let name = |i, count| layer_file(Path::new("a/b.png"), i, count).display().to_string();
        assert_eq!([name(0, 1), name(7, 8), name(9999, 10_000)], ["a/b.png", "a/b-0007.png", "a/b-9999.png"]);
        assert_eq!([name(7, 10_001), name(10_000, 10_001)], ["a/b-00007.png", "a/b-10000.png"]);
    }

    #[test]
    fn whole_numbers_of_cells_are_materials() {
        let of = |on, values: &[f32]| materials(&Field { name: String::new(), on, values: values.to_vec() });
        assert_eq!(of(On::Cells, &[3.0, 255.0, 1.0, 3.0]), Some(vec![1, 3, 255]));
        assert_eq!(of(On::Points, &[3.0]), None);
        for wrong in [0.0, -1.0, 256.0, 1.5, f32::NAN, f32::INFINITY] {
            assert_eq!(of(On::Cells, &[3.0, wrong]), None, "{wrong}");
        }
    }
}
