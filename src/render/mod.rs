//! What a picture is (SPEC 3.3): camera, transfer function and settings, and the [`Plan`] that they make of a mesh. Knows no Vulkan: the
//! kernels and the reference renderer both draw a plan, with the same operations in the same order.
//!
//! # Definition
//! - The ray of pixel (x, y), row 0 on top, is [`RayGrid::ray`]. Sample k lies at `origin + direction · ((k + ½)·Δ)`, whatever the tree.
//! - A sample outside the mesh, or whose value is not finite, adds nothing. Another one has the value v of the field at its owner,
//!   the place x = clamp((v − lo)·scale, 0, 1) in the transfer function, and the colour and opacity of [`Plan::lookup`] there.
//! - Front to back, with colour C and opacity A from 0: `w = (1 − A)·a`, `C += w·c`, `A += w`, until A reaches the termination.
//! - Colours are composited as the sRGB values they are displayed with (as `ParaView` does), not as light: a transfer function
//!   looks like its legend, and no conversion is needed anywhere.
//! - The opacity of a transfer function belongs to a length, [`OPACITY_UNIT`] of the mesh's diagonal: a ray through that much of one
//!   value is covered so far, whatever the step. The table holds `1 − (1 − a)^(s·Δ/unit)` for the opacity scale s.
//! - With shading, c is lit and a grows on surfaces seen from the side, as [`Lighting::shade`] says, by normals that
//!   [`shading_normals`] gives the vertices.
//! - Iso-surfaces instead of the volume: between two samples one after the other, both with a value, each iso value that just one of them is below
//!   adds colour and opacity of its place, as one surface, in the order along the ray. It lies where the value is linear between the two, which is
//!   exact if they lie in one cell, with that cell's normals ([`gradient_normals`]).

pub mod auto;
pub mod camera;
mod drawn;
pub mod maps;
pub mod plan;
pub mod settings;
pub mod shading;
pub mod transfer;

pub use auto::auto_opacity;
pub use camera::{Bounds, Camera, CameraSpec, Projection, RayGrid};
pub use plan::{MAX_SAMPLES, Plan, Prepared, TABLE_SIZE, interval_slack};
pub use settings::{Background, OPACITY_UNIT, RenderSettings};
pub use shading::{Lighting, Shade, gradient_normals, shading_normals};
pub use transfer::TransferFunction;

/// `1/√x` of a normal positive `x` by correctly rounded multiplications and subtractions alone, so that every device gets the same
/// bits; relative error below 2^-22. Twin of the function in the shading kernel.
pub fn inverse_sqrt(x: f32) -> f32 {
    let mut r = f32::from_bits(0x5f37_59df - (x.to_bits() >> 1));
    let half = x * 0.5;
    for _ in 0..4 {
        r *= 1.5 - (half * r) * r;
    }
    r
}
