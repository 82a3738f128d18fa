//! Cases that compare volume rendering with the reference implementation (SPEC 3.3).

use super::failure::{Verdict, compare, compare_one, fail};
use super::meshes::MeshRecipe;
use super::twin::Twin;
use crate::build::{DeviceMesh, Tree};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::grid::CellRange;
use crate::mesh::{Field, Mesh, On};
use crate::options::{Assign, BuildOptions, Lists};
use crate::query::{Canvas, Rays, SILENT, render};
use crate::reference::volume::{Drawing, render as draw};
use crate::render::{PicturePlan, RenderSettings, TransferFunction};

/// A small picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureCase {
    pub mesh: MeshRecipe,
    pub camera: &'static str,
    /// Half-spaces that are left out, separated by spaces.
    pub clips: &'static str,
    pub on: On,
    pub shading: bool,
    /// Opacity points; `None`: opacities that fit the field.
    pub opacity: Option<&'static str>,
    /// Values of iso-surfaces to draw instead of the volume; empty: the volume.
    pub iso: &'static [f32],
    /// Whether the same picture is also drawn in two parts, as two blocks of a mesh draw it.
    pub parts: bool,
}

/// A field with a wave through the mesh.
pub(super) fn field(mesh: &Mesh, on: On) -> Field {
    let wave = |p: &[f32; 3]| (p[0] * 0.9 + p[1] * 0.4).sin() + p[2] * 0.1;
    let values = match on {
        On::Points => mesh.points.iter().map(wave).collect(),
        On::Cells => mesh.tets.iter().map(|t| mesh.points.get(t[0] as usize).map_or(0.0, wave)).collect(),
    };
    Field { name: "wave".into(), on, values }
}

pub(crate) fn check(gpu: &Gpu, case: &PictureCase, twin: &mut Twin, device: &DeviceMesh) -> Verdict {
    let field = field(&twin.mesh, case.on);
    let mut transfer = TransferFunction::default();
    if let Some(opacity) = case.opacity {
        transfer = transfer.with_opacity(TransferFunction::parse_opacity(opacity)?)?;
    }
    let settings = RenderSettings {
        size: [40, 34],
        camera: case.camera.parse()?,
        clips: case.clips.split_whitespace().map(str::parse).collect::<Result<_>>()?,
        shading: case.shading,
        transfer,
        iso: case.iso.to_vec(),
        ..RenderSettings::default()
    };
    let mut first: Option<Vec<u8>> = None;
    let (all, boundary) = (Lists::All, Lists::Boundary);
    for (alpha, assign, lists) in [(0.0, Assign::Aabb, all), (0.0, Assign::Planes, boundary), (2.0, Assign::Exact, all)] {
        let options = BuildOptions { alpha, assign, lists, slabs: true, ..BuildOptions::default() };
        let built = twin.tree(&options)?;
        let scene = Drawing::new(&twin.mesh, &twin.topology, built.tree(), &field, &settings)?;
        let plan = scene.plan();
        let tree = Tree::build(gpu, device, &options)?;
        let normals = &scene.prepared().normals;
        let normals = (!normals.is_empty()).then_some(normals.as_slice());
        let drawn = render(&tree, plan, (&field.values, field.on), normals, SILENT)?;
        let pixels = plan.pixels(&drawn.colors, 1);
        let expected = draw(&scene, SILENT)?;
        let stage = format!("query.volume_march (alpha {alpha}, {assign}, lists {lists})");
        // Ray intervals depend on the leaves of the tree, the picture does not.
        compare_one(&stage, "found samples", &expected.stats.found_samples, &drawn.stats.found_samples)?;
        compare_one(&stage, "skipped samples", &expected.stats.skipped_samples, &drawn.stats.skipped_samples)?;
        near(&stage, "pixels", &plan.pixels(&expected.colors, 1), &pixels, 2, 1)?;
        // The colours must equal, to the bit, those of pictures that are drawn in other ways.
        let mut others = Vec::new();
        let hides = plan.hides(&field.values);
        if hides {
            let all = PicturePlan { visible_values: vec![[f32::NEG_INFINITY, f32::INFINITY]], ..plan.clone() };
            others.push(("every sample", render(&tree, &all, (&field.values, field.on), normals, SILENT)?.colors));
        }
        if case.parts {
            let mut rays = Rays::new(plan.size)?;
            for cells in halves(plan) {
                let canvas = Canvas::new(gpu, &(&tree).into(), plan, (&field.values, field.on), normals, true)?;
                canvas.draw_part(cells, &vec![true; plan.size[1] as usize], &mut rays)?;
            }
            others.push(("two parts", rays.colors));
        }
        let bits = |colors: &[[f32; 4]]| colors.iter().map(|c| c.map(f32::to_bits)).collect::<Vec<_>>();
        for (of, colors) in others {
            let same = compare(&stage, &format!("colours compared with those of {of}"), &bits(&colors), &bits(&drawn.colors));
            twin.same_unless_tangled(same)?;
        }
        if let Some(first) = &first {
            let same = near(&stage, "pixels compared with those of alpha 0", first, &pixels, 1, 0);
            // From full lists, samples get other owners only if others have been skipped before them.
            if lists == all && !hides { same } else { twin.same_unless_tangled(same) }?;
        }
        first.get_or_insert(pixels);
    }
    Ok(())
}

/// Two halves of the finest grid in the order in which all rays of a picture meet them. Both are whole leaves of every
/// tree but one that is a single leaf.
fn halves(plan: &PicturePlan) -> [CellRange; 2] {
    let [right, bottom] = plan.size.map(|n| n - 1);
    let ways = [(0, 0), (right, 0), (0, bottom), (right, bottom)].map(|(x, y)| plan.rays.ray(x, y).1);
    let [mut low, mut high] = [CellRange::WHOLE; 2];
    // The rays of the cases that are drawn in halves agree in the sign of one axis.
    let axis = (0..3).find(|&c| ways.iter().all(|way| way[c] * ways[0][c] > 0.0)).unwrap_or(0);
    (low.hi[axis], high.lo[axis]) = (511, 512);
    if ways[0][axis] > 0.0 { [low, high] } else { [high, low] }
}

/// Checks that two pictures are similar: at most `of_thousand` thousandths of the channels differ by more than `most`.
fn near(stage: &str, what: &str, expected: &[u8], found: &[u8], most: u8, of_thousand: usize) -> Verdict {
    compare_one(stage, "pixels.len()", &expected.len(), &found.len())?;
    let far: Vec<usize> = (0..expected.len()).filter(|&i| expected[i].abs_diff(found[i]) > most).collect();
    match far.first() {
        Some(&i) if far.len() * 1000 > expected.len() * of_thousand => {
            let found = format!("{} ({} of {} differ by more than {most})", found[i], far.len(), expected.len());
            Err(fail(stage, what, Some(i), &expected[i].to_string(), &found))
        }
        _ => Ok(()),
    }
}
