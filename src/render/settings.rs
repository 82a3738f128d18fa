//! The settings of a picture.

use super::clip::MAX_CLIPS;
use super::{CameraSpec, Clip, TransferFunction, transfer};
use crate::error::{Error, Result};

/// The length that opacities of a transfer function refer to, as a part of the diagonal of the mesh's bounds.
pub const OPACITY_UNIT: f64 = 0.01;
/// Default number of steps per diagonal.
pub const DEFAULT_STEPS: f64 = 512.0;
/// Most iso-surfaces of a picture.
pub const MAX_ISO: usize = 8;
/// Largest width and height of a picture.
pub const MAX_SIZE: u32 = 16_384;

/// What is behind the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// Nothing: the picture has an alpha channel.
    Transparent,
    /// A colour, sRGB 0…1.
    Color([f32; 3]),
    /// A vertical gradient from the top's colour to the bottom's.
    Gradient([f32; 3], [f32; 3]),
}

/// Settings of a picture; the defaults frame the mesh and show its inside.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The camera.
    pub camera: CameraSpec,
    /// A camera that is not placed by hand frames the bounds of the mesh, not only the mesh.
    pub frames_bounds: bool,
    /// Half-spaces that are left out, up to [`MAX_CLIPS`].
    pub clips: Vec<Clip>,
    /// Colours and opacities.
    pub transfer: TransferFunction,
    /// Values whose iso-surfaces are drawn instead of the volume, up to [`MAX_ISO`]; if empty, the volume is drawn.
    /// Surfaces are opaque unless `transfer` has opacities, which are then those of the surfaces themselves.
    pub iso: Vec<f32>,
    /// The field's values at places 0 and 1 of the transfer function. The default is the range of the transfer
    /// function, or else the whole range of the field.
    pub range: Option<[f32; 2]>,
    /// Distance Δ of two samples in mesh units; by default 1/512 of the diagonal. [`super::suited_step`]
    /// is finer for thin walls and layers.
    pub step: Option<f64>,
    /// What is behind the mesh.
    pub background: Background,
    /// Factor on the extinction; 2 is as opaque as twice the path through the mesh.
    pub opacity_scale: f32,
    /// Opacity at which a ray ends.
    pub termination: f32,
    /// Lights the surface and the field's gradient.
    pub shading: bool,
    /// Least opacity per unit, 0…1, of a lit surface seen from the side, which keeps outlines crisp where the field is
    /// faint; 0: none.
    pub outline: f32,
    /// Direction to the light relative to the picture: right, up, towards the viewer; of any length.
    pub light: [f32; 3],
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            size: [1024, 1024],
            camera: CameraSpec::default(),
            frames_bounds: false,
            clips: Vec::new(),
            transfer: TransferFunction::default(),
            iso: Vec::new(),
            range: None,
            step: None,
            background: Background::Color([1.0; 3]),
            opacity_scale: 1.0,
            termination: 0.99,
            shading: true,
            outline: 0.35,
            light: [-0.45, 0.65, 1.0],
        }
    }
}

impl RenderSettings {
    /// Checks that the settings can be drawn.
    ///
    /// # Errors
    /// [`Error::Invalid`], which names the setting and its limits.
    pub fn check(&self) -> Result<()> {
        let fail = |message: String| Err(Error::Invalid(message));
        if self.size.iter().any(|v| !(1..=MAX_SIZE).contains(v)) {
            return fail(format!("a picture of {}x{} pixels; both lie between 1 and {MAX_SIZE}", self.size[0], self.size[1]));
        }
        if let Some(step) = self.step.filter(|step| !(step.is_finite() && *step > 0.0)) {
            return fail(format!("a step of {step}; it is a length above 0"));
        }
        if let Some([lo, hi]) = self.range.filter(|[lo, hi]| !(lo <= hi && lo.is_finite() && hi.is_finite())) {
            return fail(format!("a range from {lo} to {hi}; it needs finite numbers, the first not above the second"));
        }
        if self.clips.len() > MAX_CLIPS {
            return fail(format!("{} clips; give up to {MAX_CLIPS}", self.clips.len()));
        }
        if self.iso.len() > MAX_ISO || !self.iso.iter().all(|v| v.is_finite()) {
            return fail(format!("iso-surfaces at {:?}; give up to {MAX_ISO} finite values", self.iso));
        }
        if !(self.opacity_scale.is_finite() && self.opacity_scale > 0.0) {
            return fail(format!("an opacity scale of {}; it lies above 0", self.opacity_scale));
        }
        if !(self.termination > 0.0 && self.termination <= 1.0) {
            return fail(format!("a termination at opacity {}; it lies above 0, up to 1", self.termination));
        }
        if !(0.0..=1.0).contains(&self.outline) {
            return fail(format!("an outline of {}; it lies between 0 and 1", self.outline));
        }
        if !self.light.iter().all(|v| v.is_finite()) || self.light == [0.0; 3] {
            return fail("the direction to the light needs three finite numbers, not all 0".into());
        }
        Ok(())
    }
}

impl std::str::FromStr for Background {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let color = |name: &str| match name.trim() {
            "white" => Some([1.0; 3]),
            "black" => Some([0.0; 3]),
            "grey" | "gray" => Some([0.5; 3]),
            hex => transfer::parse_color(hex),
        };
        let found = match text.trim() {
            "transparent" | "none" => Some(Self::Transparent),
            text => match text.split_once(',') {
                Some((top, bottom)) => color(top).zip(color(bottom)).map(|(top, bottom)| Self::Gradient(top, bottom)),
                None => color(text).map(Self::Color),
            },
        };
        found.ok_or_else(|| {
            Error::Invalid(format!("`{text}` is no background; give white, black, grey, transparent, #rrggbb, or two colours TOP,BOTTOM"))
        })
    }
}

impl Background {
    /// Colour and alpha of the background in row `y` of `height`.
    pub fn at(&self, y: u32, height: u32) -> [f32; 4] {
        let [r, g, b] = match *self {
            Self::Transparent => return [0.0; 4],
            Self::Color(color) => color,
            Self::Gradient(top, bottom) => {
                let t = (y as f32 + 0.5) / height.max(1) as f32;
                [0, 1, 2].map(|c| top[c] + (bottom[c] - top[c]) * t)
            }
        };
        [r, g, b, 1.0]
    }

    /// The pixel for a ray's colour (premultiplied) and opacity in row `y`: composited over the background, with
    /// straight alpha, rounded to 8 bits.
    pub fn pixel(&self, ray: [f32; 4], y: u32, height: u32) -> [u8; 4] {
        let behind = self.at(y, height);
        let alpha = ray[3] + (1.0 - ray[3]) * behind[3];
        let over = |c: usize| ray[c] + (1.0 - ray[3]) * behind[c] * behind[3];
        let straight = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
        let bytes = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        [bytes(over(0) * straight), bytes(over(1) * straight), bytes(over(2) * straight), bytes(alpha)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_over_backgrounds() {
        let white: Background = "white".parse().unwrap();
        assert_eq!(white.pixel([0.5, 0.0, 0.0, 0.5], 0, 1), [255, 128, 128, 255]);
        assert_eq!(Background::Transparent.pixel([0.5, 0.0, 0.0, 0.5], 0, 1), [255, 0, 0, 128]);
        assert_eq!(Background::Transparent.pixel([0.0; 4], 0, 1), [0; 4]);
        let gradient: Background = "#ffffff,#000000".parse().unwrap();
        assert_eq!(gradient.pixel([0.0; 4], 0, 2)[0], 191);
        for bad in ["", "pink", "#12345", "white,", "white,black,grey"] {
            assert!(bad.parse::<Background>().is_err(), "{bad}");
        }
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let good = RenderSettings::default();
        good.check().unwrap();
        let bad = [
            RenderSettings { size: [0, 5], ..good.clone() },
            RenderSettings { size: [5, 20_000], ..good.clone() },
            RenderSettings { step: Some(0.0), ..good.clone() },
            RenderSettings { step: Some(f64::NAN), ..good.clone() },
            RenderSettings { range: Some([2.0, 1.0]), ..good.clone() },
            RenderSettings { opacity_scale: -1.0, ..good.clone() },
            RenderSettings { termination: 0.0, ..good.clone() },
            RenderSettings { light: [0.0; 3], ..good },
        ];
        for settings in bad {
            assert!(settings.check().is_err(), "{settings:?}");
        }
    }
}
