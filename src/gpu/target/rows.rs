//! The table of targets: one row per kind of device.
//!
//! Measured: `cpu` (lavapipe), and the sort and the scan of `nvidia` (H100). There, a sort of 512 × 8 pairs per tile is
//! the fastest, and one of 256 × 8 takes a third longer; more rows take registers, and leave too few subgroups to hide
//! latency. The other rows have the latter, which fewer invocations can run. 256 × 16 of the scan is within 2% of the best.
//! Workgroup sizes of the other kernels follow from the resources of a core: small where registers are few or subgroups
//! narrow. `olbvh tune` finds better parameters for the device at hand.

use super::{ScanTarget, SortTarget, Target, TileTarget, WorkgroupLimits};
use crate::gpu::{DeviceKind, DeviceReport};
use crate::named::named;
use ash::vk::DriverId;
use std::borrow::Cow;

/// A kind of device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DeviceClass {
    /// Any other device with narrow cores.
    Portable,
    /// A processor, which runs a workgroup as a loop over a wide vector.
    Cpu,
    /// NVIDIA.
    Nvidia,
    /// AMD.
    Amd,
    /// Intel.
    Intel,
    /// Apple.
    Apple,
    /// Arm: Mali and Immortalis.
    Arm,
    /// Qualcomm: Adreno.
    Qualcomm,
}

named!(
    DeviceClass,
    "target",
    [
        Portable = "portable",
        Cpu = "cpu",
        Nvidia = "nvidia",
        Amd = "amd",
        Intel = "intel",
        Apple = "apple",
        Arm = "arm",
        Qualcomm = "qualcomm",
    ]
);

/// The parameters of a row; workgroup sizes are rounded up to whole subgroups.
struct Numbers {
    /// Whether the scan is serial, workgroup size, values per invocation.
    scan: (bool, u32, u32),
    spine: u32,
    /// Whether the sort is serial, workgroup size, pairs per invocation, bits per digit.
    sort: (bool, u32, u32, u32),
    each: u32,
    /// Workgroup size, and entries per invocation, of kernels over runs of entries.
    run: (u32, u32),
    query: u32,
}

impl DeviceClass {
    #[rustfmt::skip]
    #[allow(clippy::match_same_arms, reason = "a row for each kind of device, also where two are equal")]
    fn numbers(self) -> Numbers {
        let (cpu, simt) = (true, false);
        match self {
            // Few long tiles, and no barriers.
            Self::Cpu      => Numbers { scan: (cpu, 1, 512),   spine: 256,  sort: (cpu, 1, 8192, 11),   each: 64,  run: (1, 1024), query: 64 },
            Self::Portable => Numbers { scan: (simt, 256, 16), spine: 256,  sort: (simt, 256, 8, 8),    each: 256, run: (256, 16), query: 256 },
            Self::Nvidia   => Numbers { scan: (simt, 256, 16), spine: 1024, sort: (simt, 512, 8, 8),    each: 256, run: (256, 16), query: 128 },
            Self::Amd      => Numbers { scan: (simt, 256, 16), spine: 256,  sort: (simt, 256, 8, 8),    each: 256, run: (256, 16), query: 64 },
            Self::Intel    => Numbers { scan: (simt, 128, 16), spine: 256,  sort: (simt, 128, 8, 8),    each: 128, run: (128, 16), query: 64 },
            Self::Apple    => Numbers { scan: (simt, 256, 16), spine: 256,  sort: (simt, 256, 8, 8),    each: 256, run: (256, 16), query: 64 },
            Self::Arm      => Numbers { scan: (simt, 64, 16),  spine: 128,  sort: (simt, 64, 9, 8),     each: 64,  run: (64, 16),  query: 64 },
            Self::Qualcomm => Numbers { scan: (simt, 128, 16), spine: 256,  sort: (simt, 128, 8, 8),    each: 128, run: (128, 16), query: 64 },
        }
    }

    /// The row's target, fitted to a device with these limits.
    pub fn target(self, room: &WorkgroupLimits) -> Target {
        let Numbers { scan, spine, sort, each, run, query } = self.numbers();
        let (serial, workgroup, rows) = scan;
        let scan = ScanTarget { serial, workgroup, rows };
        let (serial, workgroup, rows, digit_bits) = sort;
        let sort = SortTarget { serial, workgroup, rows, digit_bits };
        let (workgroup, rows) = run;
        let run = TileTarget { workgroup, rows };
        Target { name: Cow::Borrowed(self.name()), scan, spine, sort, each, run, query }.fit(room)
    }

    /// The row for a device: by its driver where that is more specific than the vendor, otherwise by the vendor.
    pub fn of(device: &DeviceReport) -> Self {
        Self::choose(device.kind == DeviceKind::Cpu, DriverId::from_raw(device.driver_id), device.vendor)
    }

    fn choose(processor: bool, driver: DriverId, vendor: u32) -> Self {
        // Mesa's driver for Apple's GPUs, which `ash` has no name for.
        const HONEYKRISP: DriverId = DriverId::from_raw(26);
        match (driver, vendor) {
            _ if processor => Self::Cpu,
            (DriverId::MESA_LLVMPIPE | DriverId::GOOGLE_SWIFTSHADER, _) => Self::Cpu,
            (HONEYKRISP, _) | (_, 0x106b) => Self::Apple,
            (_, 0x10de) => Self::Nvidia,
            (_, 0x1002 | 0x1022) => Self::Amd,
            (_, 0x8086) => Self::Intel,
            (_, 0x13b5) => Self::Arm,
            (_, 0x5143) => Self::Qualcomm,
            _ => Self::Portable,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_find_their_rows() {
        let proprietary = DriverId::NVIDIA_PROPRIETARY;
        assert_eq!(DeviceClass::choose(false, proprietary, 0x10de), DeviceClass::Nvidia);
        assert_eq!(DeviceClass::choose(false, DriverId::MESA_RADV, 0x1002), DeviceClass::Amd);
        assert_eq!(DeviceClass::choose(false, DriverId::from_raw(26), 0x1_0005), DeviceClass::Apple);
        assert_eq!(DeviceClass::choose(false, DriverId::MOLTENVK, 0x106b), DeviceClass::Apple);
        assert_eq!(DeviceClass::choose(false, DriverId::MOLTENVK, 0x1002), DeviceClass::Amd);
        assert_eq!(DeviceClass::choose(false, DriverId::ARM_PROPRIETARY, 0x13b5), DeviceClass::Arm);
        assert_eq!(DeviceClass::choose(false, DriverId::QUALCOMM_PROPRIETARY, 0x5143), DeviceClass::Qualcomm);
        assert_eq!(DeviceClass::choose(true, DriverId::MESA_LLVMPIPE, 0x1_0005), DeviceClass::Cpu);
        assert_eq!(DeviceClass::choose(false, DriverId::from_raw(0), 0x1010), DeviceClass::Portable);
    }

    #[test]
    fn every_row_fits_the_least_device() {
        for row in DeviceClass::EVERY {
            assert_eq!(row.name().parse::<DeviceClass>().unwrap(), row);
            for subgroup in [4, 8, 16, 32, 64, 128] {
                let room = WorkgroupLimits::least(subgroup);
                let target = row.target(&room);
                target.check(&room).unwrap();
                target.check_scale().unwrap();
            }
        }
        assert!("gpu".parse::<DeviceClass>().is_err_and(|e| e.to_string().contains("portable, cpu, nvidia")));
    }

    #[test]
    fn rows_keep_their_digits_where_subgroups_are_the_vendors() {
        for (row, subgroup) in [
            (DeviceClass::Nvidia, 32),
            (DeviceClass::Amd, 64),
            (DeviceClass::Amd, 32),
            (DeviceClass::Intel, 16),
            (DeviceClass::Apple, 32),
            (DeviceClass::Arm, 16),
        ] {
            assert_eq!(row.target(&WorkgroupLimits::least(subgroup)).sort.digit_bits, 8, "{row:?}");
        }
        assert_eq!(
            DeviceClass::Cpu.target(&WorkgroupLimits::least(8)).sort,
            SortTarget { serial: true, workgroup: 8, rows: 8192, digit_bits: 11 }
        );
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let room = WorkgroupLimits::least(32);
        let target = DeviceClass::Portable.target(&room);
        let refused = |change: fn(&mut Target)| {
            let mut target = target.clone();
            change(&mut target);
            target.check(&room).and_then(|()| target.check_scale()).unwrap_err().to_string()
        };
        assert!(refused(|t| t.each = 48).contains("each is 48; it must be a multiple of 32, the subgroup size, up to 256"));
        assert!(refused(|t| t.query = 512).contains("query is 512"));
        assert!(refused(|t| t.scan.rows = 0).contains("scan.rows is 0"));
        assert!(refused(|t| t.sort.digit_bits = 13).contains("sort.digit_bits is 13"));
        assert!(refused(|t| t.sort.digit_bits = 10).contains("41480 bytes of shared memory of 16384"));
        assert!(refused(|t| t.sort.rows = 8192).contains("sort.rows is 8192; with ballots, it must be from 1 to 64"));
        let serial = |t: &mut Target| t.sort = SortTarget { serial: true, workgroup: 32, rows: 32_000, digit_bits: 11 };
        assert!(refused(serial).contains("the sort loops 34048 times, 32768 are allowed; sort.rows must be smaller"));
        assert!(refused(|t| t.run.rows = 4).contains("run.rows is 4; for large meshes it must be 12"));
        assert!(refused(|t| t.scan.rows = 1).contains("scan.workgroup × scan.rows × spine is 65536"));
    }
}
