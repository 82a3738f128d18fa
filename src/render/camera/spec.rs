//! The textual form of a camera.

use super::{Bounds, Camera, DEFAULT_FOV, Projection, three_quarter};
use crate::error::{Error, Result};
use glam::DVec3;

/// A camera as a user describes it, in the coordinates of the mesh's source. Whatever is left open is chosen so that
/// the mesh is framed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraSpec {
    /// The side to look from, as a direction from the mesh to the eye; ignored with `eye`.
    pub from: Option<DVec3>,
    /// Degrees around the vertical axis, 0 = from −y (front), 90 = from +x (right); ignored with `eye`.
    pub azimuth: Option<f64>,
    /// Degrees above the horizon; ignored with `eye`.
    pub elevation: Option<f64>,
    /// Position of the eye.
    pub eye: Option<DVec3>,
    /// The point that the eye looks at; by default the centre of the mesh. Without `eye`, it moves the framed camera.
    pub target: Option<DVec3>,
    /// The direction that is up in the picture; z by default.
    pub up: Option<DVec3>,
    /// Perspective angle from top to bottom, in degrees.
    pub fov: Option<f64>,
    /// Orthographic projection, with a height in mesh units or framed.
    pub ortho: Option<Option<f64>>,
    /// Magnification.
    pub zoom: Option<f64>,
}

/// Named views, as directions from the mesh to the eye. `iso` is the default three-quarter view, which depends on the
/// mesh's shape.
const VIEWS: [(&str, Option<DVec3>); 13] = [
    ("iso", None),
    ("front", Some(DVec3::NEG_Y)),
    ("back", Some(DVec3::Y)),
    ("left", Some(DVec3::NEG_X)),
    ("right", Some(DVec3::X)),
    ("top", Some(DVec3::Z)),
    ("bottom", Some(DVec3::NEG_Z)),
    ("+x", Some(DVec3::X)),
    ("-x", Some(DVec3::NEG_X)),
    ("+y", Some(DVec3::Y)),
    ("-y", Some(DVec3::NEG_Y)),
    ("+z", Some(DVec3::Z)),
    ("-z", Some(DVec3::NEG_Z)),
];

/// The syntax of a camera's text, for errors and help.
pub const HELP: &str = "a view (iso, front, back, left, right, top, bottom, +x, -x, +y, -y, +z or -z), settings, or both, separated by commas. \
Settings are azimuth=DEGREES and elevation=DEGREES of the eye as seen from the mesh, or the eye itself, eye=X,Y,Z; target=X,Y,Z, the point that is looked \
at; up=X,Y,Z; fov=DEGREES from top to bottom, or ortho, or ortho=HEIGHT; zoom=FACTOR";

/// Keys of settings.
const KEYS: [&str; 8] = ["azimuth", "elevation", "zoom", "fov", "ortho", "eye", "target", "up"];

/// Parts of a camera that contradict each other.
const CONTRADICTIONS: [[&str; 2]; 4] = [["eye", "view"], ["eye", "azimuth"], ["eye", "elevation"], ["fov", "ortho"]];

impl std::str::FromStr for CameraSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut spec = Self::default();
        let mut given = Vec::new();
        let mut parts = text.split(',').map(str::trim).peekable();
        while let Some(part) = parts.next() {
            // The numbers of a vector are separated by commas as well, so numbers that follow without a key belong to
            // this part.
            let mut part = part.to_owned();
            while let Some(next) = parts.next_if(|next| part.contains('=') && next.parse::<f64>().is_ok()) {
                part = format!("{part},{next}");
            }
            let key = spec.set(&part)?;
            if given.contains(&key) {
                return Err(Error::Invalid(format!("`{part}` is a second {key}; give one")));
            }
            given.push(key);
        }
        if let Some([a, b]) = CONTRADICTIONS.iter().find(|pair| pair.iter().all(|key| given.contains(key))) {
            return Err(Error::Invalid(format!("{a} and {b} contradict each other; give one of them")));
        }
        if ["view", "azimuth", "elevation"].iter().all(|key| given.contains(key)) {
            return Err(Error::Invalid("azimuth and elevation leave nothing to the view; give two of the three".into()));
        }
        Ok(spec)
    }
}

/// A finite number.
fn number(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|v| v.is_finite())
}

impl CameraSpec {
    /// Sets what one part of a text describes, `VIEW` or `KEY=VALUE`; returns the name of what was set.
    fn set(&mut self, part: &str) -> Result<&'static str> {
        let wrong = |why: &str| Error::Invalid(format!("`{part}` {why}; a camera is {HELP}"));
        let Some((key, values)) = part.split_once('=') else {
            if part.eq_ignore_ascii_case("ortho") {
                self.ortho = Some(None);
                return Ok("ortho");
            }
            let view = VIEWS.iter().find(|(name, _)| name.eq_ignore_ascii_case(part));
            self.from = view.ok_or_else(|| wrong("is no view"))?.1;
            return Ok("view");
        };
        let values: Option<Vec<f64>> = values.split(',').map(number).collect();
        let values = values.ok_or_else(|| wrong("needs finite numbers"))?;
        let vector = || match values[..] {
            [x, y, z] => Ok(Some(DVec3::new(x, y, z))),
            _ => Err(wrong("needs three numbers")),
        };
        let scalar = |ok: &dyn Fn(f64) -> bool, range: &str| match values[..] {
            [v] if ok(v) => Ok(Some(v)),
            _ => Err(wrong(&format!("needs one number {range}"))),
        };
        let key = match key.trim().to_ascii_lowercase().as_str() {
            "az" => "azimuth",
            "el" => "elevation",
            key => KEYS.into_iter().find(|&known| known == key).ok_or_else(|| wrong("has an unknown key"))?,
        };
        match key {
            "azimuth" => self.azimuth = scalar(&|_| true, "of degrees")?,
            "elevation" => self.elevation = scalar(&|v| v.abs() <= 90.0, "from -90 to 90")?,
            "zoom" => self.zoom = scalar(&|v| v > 0.0, "above 0")?,
            "fov" => self.fov = scalar(&|v| v > 0.0 && v <= 179.0, "above 0, up to 179")?,
            "ortho" => self.ortho = Some(scalar(&|v| v > 0.0, "above 0")?),
            "eye" => self.eye = vector()?,
            "target" => self.target = vector()?,
            _ => self.up = vector()?,
        }
        Ok(key)
    }

    /// The camera for a mesh with these bounds, whose coordinates are relative to `origin`; `aspect` is width over
    /// height.
    ///
    /// # Errors
    /// [`Error::Invalid`] if eye and target are the same point.
    pub fn resolve(&self, bounds: &Bounds, origin: [f64; 3], aspect: f64) -> Result<Camera> {
        self.resolve_around(bounds, &bounds.corners(), origin, aspect)
    }

    /// As [`CameraSpec::resolve`], but framed around `points` within the bounds instead of the corners.
    ///
    /// # Errors
    /// As [`CameraSpec::resolve`].
    pub fn resolve_around(&self, bounds: &Bounds, points: &[DVec3], origin: [f64; 3], aspect: f64) -> Result<Camera> {
        let local = |p: DVec3| p - DVec3::from_array(origin);
        let corners = bounds.corners();
        let center = (corners[0] + corners[7]) * 0.5;
        let target = self.target.map_or(center, local);
        let up = self.up.unwrap_or(DVec3::Z);
        let fov = if self.ortho.is_some() { None } else { Some(self.fov.unwrap_or(DEFAULT_FOV)) };
        let framed = Camera::frame_from(bounds, points, aspect, self.direction(bounds), up, fov);
        let mut camera = match self.eye.map(local) {
            Some(eye) => {
                let projection = match self.ortho {
                    None => Projection::Perspective(self.fov.unwrap_or(DEFAULT_FOV)),
                    Some(_) => framed.projection,
                };
                Camera::look_at(eye, target, up, projection)?
            }
            None => Camera { eye: framed.eye + (target - center), ..framed },
        };
        if let Some(Some(height)) = self.ortho {
            camera.projection = Projection::Orthographic(height);
        }
        let zoom = self.zoom.unwrap_or(1.0);
        camera.projection = match camera.projection {
            Projection::Perspective(degrees) => {
                Projection::Perspective(((degrees.to_radians() * 0.5).tan() / zoom).atan().to_degrees() * 2.0)
            }
            Projection::Orthographic(height) => Projection::Orthographic(height / zoom),
        };
        Ok(camera)
    }

    /// Direction from the mesh to the eye.
    fn direction(&self, bounds: &Bounds) -> DVec3 {
        let base = self.from.unwrap_or_else(|| three_quarter(bounds)).normalize_or(DVec3::NEG_Y);
        if self.azimuth.is_none() && self.elevation.is_none() {
            return base;
        }
        let azimuth = self.azimuth.map_or_else(|| base.x.atan2(-base.y), f64::to_radians);
        let elevation = self.elevation.map_or_else(|| base.z.clamp(-1.0, 1.0).asin(), f64::to_radians);
        DVec3::new(azimuth.sin() * elevation.cos(), -azimuth.cos() * elevation.cos(), elevation.sin())
    }
}
