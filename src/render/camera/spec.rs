//! The textual form of a camera.

use super::{Camera, DEFAULT_FOV, Projection, three_quarter, upright};
use crate::error::{Error, Result};
use crate::mesh::Bounds;
use glam::{DMat3, DVec3};

/// A camera as a user describes it, in the coordinates of the mesh's source. Whatever is left open is chosen so that
/// the mesh is framed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraSpec {
    /// The side to look from, as a direction from the mesh to the eye; ignored with `eye`.
    pub from: Option<DVec3>,
    /// Degrees around the vertical axis, 0 = from the front, 90 = from the right (with z up, −y and +x); ignored with
    /// `eye`.
    pub azimuth: Option<f64>,
    /// Degrees above the horizon; ignored with `eye`.
    pub elevation: Option<f64>,
    /// Position of the eye.
    pub eye: Option<DVec3>,
    /// The point that the eye looks at; by default the centre of the mesh. Without `eye`, it moves the framed camera.
    pub target: Option<DVec3>,
    /// The vertical axis of the mesh, which is up in the picture; z by default. Front and right turn with it, as
    /// [`upright`] says.
    pub up: Option<DVec3>,
    /// Perspective angle from top to bottom, in degrees.
    pub fov: Option<f64>,
    /// Orthographic projection, with a height in mesh units or framed.
    pub ortho: Option<Option<f64>>,
    /// Magnification.
    pub zoom: Option<f64>,
}

/// Named views, as directions from the mesh to the eye. `iso` is the default three-quarter view, which depends on the
/// mesh's shape. The first [`SIDES`] turn with the vertical axis.
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

/// How many views are sides of the mesh. The others are axes of its coordinates.
const SIDES: usize = 7;

/// The syntax of a camera's text, for errors and help.
pub const HELP: &str = "a view (iso, front, back, left, right, top, bottom, +x, -x, +y, -y, +z or -z), settings, or both, separated by commas. \
Settings are azimuth=DEGREES and elevation=DEGREES of the eye as seen from the mesh, or the eye itself, eye=X,Y,Z; target=X,Y,Z, the point that is looked \
at; up=X,Y,Z, the mesh's vertical axis; fov=DEGREES from top to bottom, or ortho, or ortho=HEIGHT; zoom=FACTOR. By default z is up, and the front is at -y; \
iso, the sides and both angles turn with up, so up=0,1,0 suits meshes with y up, whose front is at +z";

/// Keys of settings.
const KEYS: [&str; 8] = ["azimuth", "elevation", "zoom", "fov", "ortho", "eye", "target", "up"];

/// Parts of a camera that contradict each other.
const CONTRADICTIONS: [[&str; 2]; 4] = [["eye", "view"], ["eye", "azimuth"], ["eye", "elevation"], ["fov", "ortho"]];

impl std::str::FromStr for CameraSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut spec = Self::default();
        let mut given = Vec::new();
        let mut turns = false;
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
            turns |= key == "view" && VIEWS[..SIDES].iter().any(|(name, _)| name.eq_ignore_ascii_case(&part));
            given.push(key);
        }
        if let Some([a, b]) = CONTRADICTIONS.iter().find(|pair| pair.iter().all(|key| given.contains(key))) {
            return Err(Error::Invalid(format!("{a} and {b} contradict each other; give one of them")));
        }
        if ["view", "azimuth", "elevation"].iter().all(|key| given.contains(key)) {
            return Err(Error::Invalid("azimuth and elevation leave nothing to the view; give two of the three".into()));
        }
        if turns {
            spec.from = spec.from.map(|side| spec.axes() * side);
        }
        Ok(spec)
    }
}

impl Camera {
    /// The text of a [`CameraSpec`] that gives this camera again, for a mesh with these bounds, whose coordinates are
    /// relative to `origin`. It looks at the point of the view's axis that is nearest to the middle of the bounds, or,
    /// with its back to them, at one as far away.
    pub fn text(&self, bounds: &Bounds, origin: [f64; 3]) -> String {
        let corners = bounds.corners();
        let depth = ((corners[0] + corners[7]) * 0.5 - self.eye).dot(self.forward).abs().max(bounds.diagonal() * 0.5);
        let vector = |v: DVec3| v.to_array().map(|x| x.to_string()).join(",");
        let eye = self.eye + DVec3::from_array(origin);
        let projection = match self.projection {
            Projection::Perspective(degrees) => format!("fov={degrees}"),
            Projection::Orthographic(height) => format!("ortho={height}"),
        };
        format!("eye={},target={},up={},{projection}", vector(eye), vector(eye + self.forward * depth), vector(self.up))
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
            _ => {
                self.up = vector()?;
                if self.up.is_some_and(|up| up.try_normalize().is_none()) {
                    return Err(wrong("needs a direction, not all 0"));
                }
            }
        }
        Ok(key)
    }

    /// The camera for a mesh with these bounds, whose coordinates are relative to `origin`; `aspect` is width over
    /// height.
    ///
    /// # Errors
    /// [`Error::Invalid`] if eye and target are the same point, or a number is out of its limits.
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
        let fov = self.fov.unwrap_or(DEFAULT_FOV);
        let mut camera = if let Some(eye) = self.eye.map(local) {
            let mut camera = Camera::look_at(eye, target, self.up.unwrap_or(DVec3::Z), Projection::Perspective(fov))?;
            if self.ortho.is_some() {
                camera.projection = Projection::Orthographic(camera.height_around(bounds, points, aspect));
            }
            camera
        } else {
            let (from, up) = self.side(bounds);
            let framed = Camera::frame_from(bounds, points, aspect, from, up, self.ortho.is_none().then_some(fov));
            // A target that was asked for lies in the middle of the picture, where the mesh need not.
            let depth = (center - framed.eye).dot(framed.forward);
            Camera { eye: self.target.map_or(framed.eye, |_| target - framed.forward * depth), ..framed }
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

    /// The axes of the mesh.
    fn axes(&self) -> DMat3 {
        upright(self.up.and_then(DVec3::try_normalize).unwrap_or(DVec3::Z))
    }

    /// Direction from the mesh to the eye, and what is up in the picture.
    fn side(&self, bounds: &Bounds) -> (DVec3, DVec3) {
        let axes = self.axes();
        let size = bounds.corners()[7] - bounds.corners()[0];
        let extent = DVec3::from_array([axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| axis.abs().dot(size)));
        let base = self.from.map_or_else(|| three_quarter(extent), |from| axes.transpose() * from).normalize_or(DVec3::NEG_Y);
        if self.azimuth.is_none() && self.elevation.is_none() {
            return (axes * base, axes.z_axis);
        }
        // A sum with 0 is not −0, so that straight above or below is at azimuth 0.
        let azimuth = self.azimuth.map_or_else(|| (base.x + 0.0).atan2(0.0 - base.y), f64::to_radians);
        let elevation = self.elevation.map_or_else(|| base.z.clamp(-1.0, 1.0).asin(), f64::to_radians);
        let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
        // Perpendicular to the view, so that the azimuth turns the picture even straight above and below.
        (axes * DVec3::new(sa * ce, -ca * ce, se), axes * DVec3::new(-sa * se, ca * se, ce))
    }
}
