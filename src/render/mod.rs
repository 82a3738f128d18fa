//! Definition of a picture (SPEC 3.3): camera, transfer function and settings, and the [`PicturePlan`] that they yield for a
//! mesh. Does not depend on Vulkan: the kernels and the reference renderer draw the same plan with the same operations
//! in the same order.
//!
//! # Definition
//! - The ray of pixel (x, y), with row 0 on top, is [`RayGrid::ray`]. Sample k lies at
//!   `origin + direction · ((k + ½)·Δ)`, independently of the tree.
//! - Samples beyond a clip ([`PicturePlan::kept_stretch`]) are not taken, nor those behind what a depth buffer shows
//!   ([`RayGrid::steps_to`]).
//! - A sample adds nothing if it lies outside the mesh or its value is not finite. Otherwise it has the field's value v
//!   in its owner, the place x = clamp((v − lo)·scale, 0, 1) in the transfer function, and the colour and opacity of
//!   [`PicturePlan::lookup`] there.
//! - Samples are composited front to back, with colour C and opacity A starting at 0: `w = (1 − A)·a`, `C += w·c`,
//!   `A += w`, until A reaches the termination.
//! - Colours are composited as the sRGB values they are displayed with (as `ParaView` does), not as light. So a
//!   transfer function looks like its legend, and no conversion is needed anywhere.
//! - The opacity of a transfer function refers to a length, [`OPACITY_UNIT`] of the mesh's diagonal: it is what a ray
//!   gathers over that length at a constant value, whatever the step. The table contains `1 − (1 − a)^(s·Δ/unit)` for
//!   the opacity scale s.
//! - With shading, c is lit and a grows on surfaces seen from the side, as defined by [`Lighting::shade`], using the
//!   normals that [`shading_normals`] computes for the vertices.
//! - Iso-surfaces replace the volume. A sample with a value shows the stretch of the ray in its tetrahedron, where the
//!   value is linear: forwards up to the next sample at most, and backwards to the one before if that has no value.
//!   Between the stretches of consecutive samples the value is taken as linear, too. Of each such piece, each iso-value
//!   that only one end is below adds the colour and opacity at its place as one surface, unless a clip or a depth leaves
//!   out that place, in the order along the ray, lit by the normals ([`gradient_normals`]) of a tetrahedron there. For this, one
//!   sample beyond each clip and depth is taken.

pub mod auto;
pub mod camera;
pub mod clip;
pub mod maps;
pub mod picture_plan;
pub mod rays;
pub mod settings;
pub mod shading;
mod stats;
mod step;
pub mod transfer;
mod valid;
mod visible_values;

pub use auto::auto_opacity;
pub use camera::{Camera, CameraSpec, ProjectedView, Projection};
pub use clip::{Clip, ClipPlace};
pub(crate) use picture_plan::interval_slack;
pub use picture_plan::{PicturePlan, Prepared, TABLE_SIZE};
pub use rays::{MAX_SAMPLES, RayGrid};
pub use settings::{Background, OPACITY_UNIT, RenderSettings};
pub use shading::{Lighting, Shade, gradient_normals, shading_normals};
pub use stats::RenderStats;
pub use step::{SuitedStep, suited_step};
pub use transfer::TransferFunction;
pub use valid::ValidTets;

/// `1/√x` of a normal positive `x`, computed by correctly rounded multiplications and subtractions alone, so that every
/// device gets the same bits. The relative error is below 2^-22. Twin of `inverse_sqrt` in `glsl/shared/rays.glsl`.
pub fn inverse_sqrt(x: f32) -> f32 {
    let mut r = f32::from_bits(0x5f37_59df_u32.wrapping_sub(x.to_bits() >> 1));
    let half = x * 0.5;
    for _ in 0..4 {
        r *= 1.5 - (half * r) * r;
    }
    r
}
