//! Tuning per kind of device: data, not code.

/// Workgroup size and items per invocation of a kernel that works on tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileTarget {
    /// Invocations per workgroup; a multiple of the subgroup size.
    pub workgroup: u32,
    /// Consecutive items per invocation.
    pub rows: u32,
}

impl TileTarget {
    /// Items per workgroup.
    pub fn tile(self) -> u32 {
        self.workgroup * self.rows
    }
}

/// Which radix sort, and its tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SortTarget {
    /// `true`: every invocation owns a serial tile of `rows` pairs. `false`: a tile is a workgroup's, ranked by ballots.
    pub serial: bool,
    /// Invocations per workgroup.
    pub workgroup: u32,
    /// Pairs per invocation.
    pub rows: u32,
    /// Most bits per digit.
    pub digit_bits: u32,
}

impl SortTarget {
    /// Pairs per tile.
    pub fn tile(self) -> u32 {
        if self.serial { self.rows } else { self.workgroup * self.rows }
    }

    /// Tiles per workgroup.
    pub fn tiles_per_group(self) -> u32 {
        if self.serial { self.workgroup } else { 1 }
    }
}

/// How the kernels are shaped for a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// Name in reports.
    pub name: &'static str,
    /// Reduce and scan.
    pub scan: TileTarget,
    /// Radix sort.
    pub sort: SortTarget,
    /// Kernels with one item per invocation.
    pub each: u32,
    /// Kernels in which an invocation passes a run of consecutive entries.
    pub run: TileTarget,
}

impl Target {
    /// The target for a device by its subgroup size and whether its "GPU" is a processor.
    pub fn select(subgroup: u32, cpu: bool) -> Self {
        if cpu {
            // A workgroup is one loop over a wide vector: few, long tiles and no barriers.
            return Self {
                name: "cpu",
                scan: TileTarget { workgroup: subgroup, rows: 512 },
                sort: SortTarget { serial: true, workgroup: subgroup, rows: 8192, digit_bits: 11 },
                each: 64.max(subgroup),
                run: TileTarget { workgroup: subgroup, rows: 256 },
            };
        }
        let workgroup = 256u32.next_multiple_of(subgroup.max(1));
        // The ballot sort keeps a table of digits per subgroup in shared memory, 16 KiB at most.
        let subgroups = (workgroup / subgroup.max(1)).max(1);
        let digit_bits = (3584 / (subgroups + 1)).max(2).ilog2().min(8);
        Self {
            name: "simt",
            scan: TileTarget { workgroup, rows: 16 },
            sort: SortTarget { serial: false, workgroup, rows: 16, digit_bits },
            each: workgroup,
            run: TileTarget { workgroup, rows: 16 },
        }
    }
}
