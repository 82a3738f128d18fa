//! The values that a transfer function shows.

use super::TABLE_SIZE;
use crate::grid::canonical;

/// Ranges of values, ascending and disjoint, outside of which every value has opacity 0 in `table`, however its place
/// is rounded. Place 0 is at `value_lo`, and there are `value_scale` places per unit of value.
pub(super) fn visible_values(table: &[[f32; 4]], value_lo: f32, value_scale: f32) -> Vec<[f32; 2]> {
    const EVERYTHING: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];
    if !value_scale.is_normal() {
        return vec![EVERYTHING];
    }
    // A value is drawn using the two entries around its place. The place is exact to 2^-12 of an entry, and the value
    // is rounded once more.
    let last = TABLE_SIZE - 1;
    let value = |entry: f64| (f64::from(value_lo) + entry / (last as f64 * f64::from(value_scale))) as f32;
    let mut visible: Vec<[f32; 2]> = Vec::new();
    for i in (0..table.len()).filter(|&i| table[i][3] > 0.0) {
        let begin = if i == 0 { EVERYTHING[0] } else { canonical(value(i as f64 - 1.01).next_down()) };
        let end = if i == last { EVERYTHING[1] } else { canonical(value(i as f64 + 1.01).next_up()) };
        match visible.last_mut() {
            Some(range) if begin <= range[1] => range[1] = end,
            _ => visible.push([begin, end]),
        }
    }
    visible
}

#[cfg(test)]
mod tests {
    use super::super::{PicturePlan, RenderSettings, TransferFunction};
    use crate::mesh::Bounds;

    const BOX: Bounds = Bounds { lo: [0.0; 3], hi: [3.0, 4.0, 12.0] };

    fn plan(opacity: &[(f32, f32)], range: [f32; 2]) -> PicturePlan {
        let transfer = TransferFunction::default().with_opacity(opacity.to_vec()).unwrap();
        PicturePlan::new(&RenderSettings { transfer, ..RenderSettings::default() }, &BOX, [0.0; 3], Some(range)).unwrap()
    }

    #[test]
    fn what_is_not_visible_is_transparent() {
        let peaks = [(0.0, 0.0), (0.2, 0.0), (0.21, 0.7), (0.22, 0.0), (0.6, 0.0), (0.6, 0.1), (0.7, 0.1), (0.7, 0.0), (1.0, 0.0)];
        for range in [[0.0, 1.0], [-1e-20, 3e-20], [1e6, 1e6 + 8.0], [-3e37, 3e37], [100.0, 300.0]] {
            let plan = plan(&peaks, range);
            assert_eq!(plan.visible_values.len(), 2, "{range:?} {:?}", plan.visible_values);
            let (mut seen, mut hidden) = (0, 0);
            for i in -100..10_100 {
                let value = (f64::from(range[0]) + f64::from(i) / 10_000.0 * (f64::from(range[1]) - f64::from(range[0]))) as f32;
                let shown = plan.visible_values.iter().any(|[lo, hi]| (*lo..=*hi).contains(&value));
                seen += u32::from(shown);
                hidden += u32::from(!shown);
                assert!(shown || plan.lookup(value)[3] == 0.0, "{range:?}: {value}");
            }
            assert!(seen < 2000 && hidden > 8000, "{range:?}: {seen} {hidden}");
        }
    }

    #[test]
    fn ends_reach_out_and_opaque_functions_show_all() {
        let plan_of = |opacity: &[(f32, f32)]| plan(opacity, [0.0, 1.0]).visible_values;
        assert_eq!(plan_of(&[(0.0, 0.1), (1.0, 0.2)]), [[f32::NEG_INFINITY, f32::INFINITY]]);
        assert_eq!(plan_of(&[(0.0, 0.0), (1.0, 0.0)]), [[0.0f32; 2]; 0]);
        // A ramp that starts at the smallest value of the field hides none of its values.
        let ramp = plan(&[(0.0, 0.0), (1.0, 0.2)], [0.0, 1.0]);
        assert!(!ramp.hides(&[0.0, 0.5, 1.0, f32::NAN]) && ramp.hides(&[0.5, -0.1]));
        let low = plan_of(&[(0.0, 0.5), (0.1, 0.0), (1.0, 0.0)]);
        assert!(low.len() == 1 && low[0][0] == f32::NEG_INFINITY && (0.09..0.11).contains(&low[0][1]), "{low:?}");
    }
}
