//! Clips: half-spaces that a picture leaves out, so that the inside is seen.

use crate::error::{Error, Result};
use crate::mesh::Bounds;
use glam::DVec3;

/// Most clips of a picture.
pub const MAX_CLIPS: usize = 4;

/// The syntax of a clip, for errors and help.
pub const HELP: &str = "DIRECTION, or DIRECTION=PLACE. DIRECTION is x, y, z, -x, -y, -z, `view` (towards the viewer) or X,Y,Z. \
PLACE is where the cut lies: `40%` of the way through the mesh's bounds in that direction, or a coordinate in units of the mesh \
(for X,Y,Z and `view`, along that direction); by default 50%";

/// A half-space that is left out: all that lies farther in a direction than a place, in the coordinates of the mesh's
/// source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip {
    /// The direction, of any length; `None`: towards the viewer.
    pub direction: Option<DVec3>,
    /// The place of the cut.
    pub place: ClipPlace,
}

/// The place of a cut along its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClipPlace {
    /// A part of the way through the mesh's bounds: 0 leaves out all, 1 nothing.
    Part(f64),
    /// The distance from the origin of the coordinates.
    At(f64),
}

/// Directions by name.
const AXES: [(&str, DVec3); 6] =
    [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z), ("-x", DVec3::NEG_X), ("-y", DVec3::NEG_Y), ("-z", DVec3::NEG_Z)];

impl std::str::FromStr for Clip {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |why: &str| Error::Invalid(format!("`{text}` {why}; a clip is {HELP}"));
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let (direction, place) = text.split_once('=').map_or((text, None), |(direction, place)| (direction, Some(place.trim())));
        let name = direction.trim().to_ascii_lowercase();
        let axis = AXES.iter().find(|(axis, _)| *axis == name.strip_prefix('+').unwrap_or(&name)).map(|(_, axis)| *axis);
        let numbers: Option<Vec<f64>> = name.split(',').map(number).collect();
        let direction = match (axis, numbers.as_deref()) {
            (Some(axis), _) => Some(axis),
            _ if name == "view" => None,
            (_, Some(&[x, y, z])) if DVec3::new(x, y, z).try_normalize().is_some() => Some(DVec3::new(x, y, z)),
            _ => return Err(wrong("has no direction")),
        };
        let part = |text: &str| number(text).map(|part| ClipPlace::Part(part / 100.0)).ok_or_else(|| wrong("needs a number before `%`"));
        // The coordinate x = 3 lies at -3 along -x.
        let sign = axis.map_or(1.0, DVec3::element_sum);
        let at = |text: &str| number(text).map(|at| ClipPlace::At(sign * at)).ok_or_else(|| wrong("needs a number after `=`"));
        let place = match place.map(|place| (place, place.strip_suffix('%'))) {
            None => ClipPlace::Part(0.5),
            Some((_, Some(percent))) => part(percent)?,
            Some((place, None)) => at(place)?,
        };
        Ok(Self { direction, place })
    }
}

impl Clip {
    /// The plane of the cut, for a view into the direction `forward`: a unit normal `n`, and `d`. Points p of the mesh, whose coordinates are relative to
    /// `origin`, are kept if n·p ≤ d.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the plane lies beyond single precision, or the direction has no length.
    pub fn resolve(&self, bounds: &Bounds, origin: [f64; 3], forward: DVec3) -> Result<[f32; 4]> {
        let along = self.direction.unwrap_or(-forward);
        let n =
            along.try_normalize().ok_or_else(|| Error::Invalid("the direction of a clip needs three finite numbers, not all 0".into()))?;
        let d = match self.place {
            ClipPlace::Part(part) => {
                let reach = bounds.corners().map(|corner| n.dot(corner));
                let [lo, hi] = reach.into_iter().fold([f64::MAX, f64::MIN], |[lo, hi], d| [lo.min(d), hi.max(d)]);
                lo + (hi - lo) * part
            }
            ClipPlace::At(at) => at - n.dot(DVec3::from_array(origin)),
        };
        let plane = n.extend(d).as_vec4().to_array();
        let is_near = plane[3].abs() < 1e38;
        if is_near { Ok(plane) } else { Err(Error::Invalid(format!("a clip at {d:e}, which lies beyond single precision"))) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds = Bounds { lo: [0.0, -2.0, 10.0], hi: [4.0, 2.0, 20.0] };

    fn plane(text: &str) -> [f32; 4] {
        text.parse::<Clip>().unwrap().resolve(&BOX, [100.0, 0.0, 0.0], DVec3::Y).unwrap()
    }

    #[test]
    fn places_are_parts_or_coordinates() {
        assert_eq!(plane("x"), [1.0, 0.0, 0.0, 2.0]);
        assert_eq!(plane("+X = 25%"), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(plane("-x=25%"), [-1.0, 0.0, 0.0, -3.0]);
        assert_eq!(plane("x=103"), [1.0, 0.0, 0.0, 3.0]);
        assert_eq!(plane("-x=103"), [-1.0, 0.0, 0.0, -3.0]);
        assert_eq!(plane("z=12"), [0.0, 0.0, 1.0, 12.0]);
        assert_eq!(plane("0,0,7=12"), [0.0, 0.0, 1.0, 12.0]);
        assert_eq!(plane("0,0,-7=12"), [0.0, 0.0, -1.0, 12.0]);
        assert_eq!(plane("view"), [0.0, -1.0, 0.0, 0.0]);
        assert_eq!(plane("view=75%"), [0.0, -1.0, 0.0, 1.0]);
    }

    #[test]
    fn wrong_clips_are_refused() {
        for (text, why) in [
            ("", "no direction"),
            ("front", "no direction"),
            ("0,0,0", "no direction"),
            ("1,2", "no direction"),
            ("1,nan,2", "no direction"),
            ("x=", "after `=`"),
            ("x=inf", "after `=`"),
            ("y=a%", "before `%`"),
        ] {
            let message = text.parse::<Clip>().unwrap_err().to_string();
            assert!(message.contains(why), "{text}: {message}");
        }
        let far = Clip { direction: Some(DVec3::X), place: ClipPlace::At(1e39) };
        let nowhere = Clip { direction: Some(DVec3::ZERO), place: ClipPlace::Part(0.5) };
        assert!([far, nowhere].iter().all(|clip| clip.resolve(&BOX, [0.0; 3], DVec3::Y).is_err()));
    }
}
