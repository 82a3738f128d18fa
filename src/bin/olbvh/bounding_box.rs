//! The edges of the mesh's bounds in a picture. They show where in the mesh a part of it lies, such as an iso-surface.

use crate::legend::ink;
use glam::{DMat3, DVec2, DVec3};
use olbvh::mesh::Bounds;
use olbvh::render::{PicturePlan, RayGrid};

/// Opacity of a line.
const OPACITY: f32 = 0.6;
/// Height of a picture whose lines are one pixel wide.
const FINE: f64 = 700.0;
/// Distance from the eye, in diagonals of the bounds, from which on a line is drawn.
const NEAR: f64 = 1e-4;

/// An edge in the plane of the picture, in rays; the centre of the first ray is the origin.
struct Line {
    ends: [DVec2; 2],
    /// Whether the edge lies before all that is within the bounds, not behind it.
    before: bool,
}

/// Where points lie in a picture, which follows from its rays.
struct Projector {
    /// Where all rays meet, or where the first one starts, if they are parallel.
    eye: DVec3,
    meet: bool,
    /// Direction of the first ray.
    forward: DVec3,
    /// From a point's place relative to `eye` to its ray along the rows and along the columns (where rays meet, times its
    /// depth), and its depth.
    place: DMat3,
}

impl Projector {
    fn new(rays: &RayGrid) -> Self {
        let [origin, origin_x, origin_y] = [rays.origin, rays.origin_x, rays.origin_y].map(double);
        let [forward, direction_x, direction_y] = [rays.direction, rays.direction_x, rays.direction_y].map(double);
        let meet = direction_x != DVec3::ZERO;
        // Rays that meet start at the same depth.
        let depth = if meet { origin_x.dot(direction_x) / direction_x.length_squared() } else { 0.0 };
        let axes = if meet { [direction_x, direction_y] } else { [origin_x, origin_y] };
        Self { eye: origin - forward * depth, meet, forward, place: DMat3::from_cols(axes[0], axes[1], forward).inverse() }
    }

    /// Whether the eye is before a side of the bounds, given by its axis.
    fn sees(&self, bounds: &Bounds, axis: usize, upper: bool) -> bool {
        let side = f64::from(if upper { bounds.hi[axis] } else { bounds.lo[axis] });
        let outwards = if self.meet { self.eye[axis] - side } else { -self.forward[axis] };
        if upper { outwards > 0.0 } else { outwards < 0.0 }
    }

    /// A line in the plane of the picture, without what is not before the eye.
    fn line(&self, ends: [DVec3; 2], near: f64) -> Option<[DVec2; 2]> {
        let [a, b] = ends.map(|end| self.place * (end - self.eye));
        if !self.meet {
            return Some([a, b].map(DVec3::truncate));
        }
        let near = near / self.forward.length();
        let cut = |a: DVec3, b: DVec3| if a.z < near { a + (b - a) * ((near - a.z) / (b.z - a.z)) } else { a };
        (a.z >= near || b.z >= near).then(|| [cut(a, b), cut(b, a)].map(|end| end.truncate() / end.z))
    }
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// Corner `i` of the bounds: bit c of the number says whether it is the upper one along axis c.
fn corner(bounds: &Bounds, i: usize) -> DVec3 {
    double([0, 1, 2].map(|c| if i >> c & 1 == 0 { bounds.lo[c] } else { bounds.hi[c] }))
}

/// Draws the edges of the bounds into the `colors` of the rays (premultiplied), of which a pixel has `across` by `across`.
pub fn draw(colors: &mut [[f32; 4]], plan: &PicturePlan, bounds: &Bounds, across: u32) {
    let lines = lines(&Projector::new(&plan.rays), bounds);
    let height = plan.size[1];
    let width = f64::from(across) * (f64::from(height / across) / FINE).max(1.0);
    let [r, g, b, _] = ink(&plan.background, height);
    for before in [false, true] {
        // Where edges meet they are no darker than elsewhere.
        let mut cover = vec![0.0f32; colors.len()];
        lines.iter().filter(|line| line.before == before).for_each(|line| line.cover(&mut cover, plan.size, width));
        for (color, share) in colors.iter_mut().zip(cover).filter(|(_, share)| *share > 0.0) {
            let a = share * OPACITY;
            let line = [r * a, g * a, b * a, a];
            let (front, back) = if before { (line, *color) } else { (*color, line) };
            *color = [0, 1, 2, 3].map(|c| front[c] + (1.0 - front[3]) * back[c]);
        }
    }
}

/// The twelve edges, without what is not before the eye.
fn lines(projector: &Projector, bounds: &Bounds) -> Vec<Line> {
    let near = NEAR * bounds.diagonal();
    let edges = (0..3).flat_map(|axis| (0..8).filter(move |i| i >> axis & 1 == 0).map(move |i| (axis, i)));
    let line = |(axis, i): (usize, usize)| {
        let ends = projector.line([i, i | 1 << axis].map(|i| corner(bounds, i)), near)?;
        let before = (0..3).any(|side| side != axis && projector.sees(bounds, side, i >> side & 1 != 0));
        Some(Line { ends, before })
    };
    edges.filter_map(line).collect()
}

impl Line {
    /// Raises the share of every ray that the line covers, where it is `width` rays wide.
    fn cover(&self, cover: &mut [f32], size: [u32; 2], width: f64) {
        let [a, b] = self.ends;
        let along = b - a;
        let Some(direction) = along.try_normalize() else { return };
        // Ray by ray along the axis on which it is longer, it covers a few rays on the other.
        let (major, minor) = if along.x.abs() > along.y.abs() { (0, 1) } else { (1, 0) };
        let reach = (width * 0.5 + 1.0) / direction[major].abs();
        let most = |axis: usize| f64::from(size[axis]) - 1.0;
        let (first, last) = (a[major].min(b[major]).ceil().max(0.0), a[major].max(b[major]).floor().min(most(major)));
        let mut at = first;
        while at <= last {
            let middle = a[minor] + (at - a[major]) * along[minor] / along[major];
            let (mut beside, end) = ((middle - reach).ceil().max(0.0), (middle + reach).floor().min(most(minor)));
            while beside <= end {
                let distance = (beside - middle).abs() * direction[major].abs();
                let (x, y) = if major == 0 { (at, beside) } else { (beside, at) };
                let share = &mut cover[y as usize * size[0] as usize + x as usize];
                *share = share.max((width * 0.5 + 0.5 - distance).clamp(0.0, 1.0) as f32);
                beside += 1.0;
            }
            at += 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use olbvh::render::RenderSettings;

    fn plan(camera: &str, bounds: &Bounds) -> PicturePlan {
        let settings = RenderSettings { size: [320, 200], camera: camera.parse().unwrap(), ..RenderSettings::default() };
        PicturePlan::new(&settings, bounds, [0.0; 3], Some([0.0, 1.0])).unwrap()
    }

    #[test]
    fn rays_pass_through_what_they_show() {
        let bounds = Bounds { lo: [1.0, -2.0, 3.0], hi: [5.0, 4.0, 4.5] };
        for name in
            ["iso", "top,ortho", "azimuth=20,elevation=-35,fov=80", "eye=1e5,2e5,3e5,target=3,1,4,fov=0.001", "front,ortho,zoom=0.5"]
        {
            let plan = plan(name, &bounds);
            let lines = lines(&Projector::new(&plan.rays), &bounds);
            assert_eq!(lines.len(), 12, "{name}");
            for end in lines.iter().flat_map(|line| line.ends) {
                let (origin, way) = plan.rays.ray(end.x.round() as u32, end.y.round() as u32);
                let beside = (0..8).map(|i| (corner(&bounds, i) - double(origin)).reject_from(double(way).normalize()).length());
                let nearest = beside.fold(f64::MAX, f64::min);
                assert!(nearest < 0.05, "{name}: a corner is {nearest} beside its ray");
            }
        }
    }

    #[test]
    fn edges_before_the_mesh_cover_it_and_those_behind_do_not() {
        let bounds = Bounds { lo: [0.0; 3], hi: [1.0; 3] };
        let plan = plan("iso", &bounds);
        let before = lines(&Projector::new(&plan.rays), &bounds).iter().filter(|line| line.before).count();
        assert_eq!(before, 9); // three sides are seen, with nine edges
        let drawn = |color: [f32; 4]| {
            let mut colors = vec![color; 320 * 200];
            draw(&mut colors, &plan, &bounds, 1);
            colors.iter().filter(|&&c| c != color).count()
        };
        let (over_white, over_clear) = (drawn([1.0; 4]), drawn([0.0; 4]));
        assert!(over_white > 500 && over_clear > over_white, "{over_white} {over_clear}");
    }

    #[test]
    fn an_eye_within_sees_what_is_before_it() {
        let bounds = Bounds { lo: [0.0; 3], hi: [1.0; 3] };
        let plan = plan("eye=0.5,0.5,0.5,target=1,0.5,0.5,fov=60", &bounds);
        let lines = lines(&Projector::new(&plan.rays), &bounds);
        assert_eq!(lines.len(), 8); // four lie behind the eye
        assert!(lines.iter().all(|line| !line.before));
    }
}
