//! Tests of pictures that owning calls draw.

use super::queries::settings;
use super::*;
use crate::capi::query::*;
use crate::query::{SILENT, render};
use crate::render::Prepared;

/// Pictures of every kind are those of the Rust interface, when the mesh is read back and afterwards. What settings do
/// not need is not read back.
pub fn pictures(tree: *mut OlbvhTree, values: &[f32], prepare: &dyn Fn(&OlbvhPictureSettings) -> Prepared) {
    let OlbvhTree { mesh, tree: built, .. } = call!(handle(tree, "tree")).unwrap();
    let camera = c"eye=9,-8,7,target=2,2,1".as_ptr();
    let given = OlbvhPictureSettings { shading: 0, camera, ..settings() };
    let lit = OlbvhPictureSettings { shading: 1, ..given };
    let iso = OlbvhPictureSettings { iso: [1.75; 8], iso_count: 1, ..given };
    let clipped = OlbvhPictureSettings { clips: c"view=90% z=80%".as_ptr(), ..given };
    assert_eq!([&clipped, &given].map(|settings| prepare(settings).plan.clips.len()), [2, 0]);
    let held = || [mesh.copy.mesh.get().is_some(), mesh.copy.neighbours.get().is_some(), mesh.copy.bad.get().is_some()];
    for (settings, needed) in [
        (given, [false; 3]),
        (iso, [false; 3]),
        (clipped, [false; 3]),
        (OlbvhPictureSettings { camera: null(), ..given }, [true, false, false]),
        (OlbvhPictureSettings { camera: c"eye=9,-8,7,ortho".as_ptr(), ..given }, [true, false, false]),
        (OlbvhPictureSettings { range: [1.0, 0.0], ..given }, [true, false, false]),
        (OlbvhPictureSettings { opacity: null(), ..given }, [true, true, false]),
        (lit, [true, true, false]),
    ] {
        let Prepared { plan, normals, .. } = prepare(&settings);
        let normals = (settings.shading != 0).then_some(&normals[..]);
        let expected = render(built, &plan, (values, On::Points), normals, SILENT).unwrap().colors;
        assert!(expected.iter().any(|color| color[3] > 0.1), "{settings:?}");
        for _ in 0..2 {
            let mut colors = vec![[0f32; 4]; 37 * 30];
            ok(call!(olbvh_render(tree, &raw const settings, values.as_ptr(), 0, colors.as_mut_ptr().cast())));
            assert!(colors == expected && held() == needed, "{settings:?} {:?}", held());
        }
    }
    let (cells, mut colors) = (vec![0f32; mesh.device.input().tets as usize], vec![[0f32; 4]; 37 * 30]);
    assert_eq!(call!(olbvh_render(tree, &raw const iso, cells.as_ptr(), 1, colors.as_mut_ptr().cast())), OlbvhStatus::Invalid);
    assert!(message().contains("a field of cells"), "{}", message());
}
