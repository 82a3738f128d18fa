//! Built-in colour maps, as control points of a piecewise-linear function on 256 steps. No channel differs by more than
//! 1.5/255 from the published table.
//!
//! Sources: viridis, magma, inferno, plasma (Smith and van der Walt, CC0); cividis (Nuñez, Anderton, Renslow 2018);
//! turbo (Mikhailov 2019); coolwarm (Moreland 2009).

/// A built-in colour map.
pub struct ColorMap {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for the help.
    pub about: &'static str,
    /// Control points: places, ascending from 0 to 255, and colours 0xRRGGBB.
    pub points: &'static [(u8, u32)],
}

/// All built-in maps; the first one is the default, [`DEFAULT_MAP`](super::transfer::DEFAULT_MAP).
pub const MAPS: &[ColorMap] = &[
    ColorMap {
        name: "viridis",
        about: "perceptually uniform, blue to yellow",
        points: &[
            (0, 0x44_01_54),
            (19, 0x48_1c_6e),
            (42, 0x44_39_83),
            (72, 0x37_5b_8d),
            (122, 0x22_8b_8d),
            (145, 0x1f_a1_88),
            (159, 0x27_ad_81),
            (177, 0x40_bd_72),
            (200, 0x70_cf_57),
            (227, 0xb5_de_2b),
            (240, 0xd8_e2_19),
            (247, 0xea_e5_1a),
            (255, 0xfd_e7_25),
        ],
    },
    ColorMap {
        name: "magma",
        about: "perceptually uniform, black to cream",
        points: &[
            (0, 0x00_00_04),
            (3, 0x01_01_08),
            (17, 0x0b_09_24),
            (37, 0x24_12_53),
            (51, 0x3b_0f_70),
            (64, 0x51_12_7c),
            (93, 0x7e_24_82),
            (124, 0xb0_35_7b),
            (151, 0xdb_47_6a),
            (170, 0xf1_60_5d),
            (185, 0xf9_7b_5d),
            (200, 0xfd_98_69),
            (222, 0xfe_c1_85),
            (255, 0xfc_fd_bf),
        ],
    },
    ColorMap {
        name: "inferno",
        about: "perceptually uniform, black to pale yellow",
        points: &[
            (0, 0x00_00_04),
            (3, 0x01_01_08),
            (15, 0x0a_07_22),
            (31, 0x1f_0c_48),
            (44, 0x36_09_61),
            (58, 0x4d_0d_6c),
            (82, 0x74_1a_6e),
            (110, 0xa0_2a_63),
            (141, 0xce_43_47),
            (167, 0xeb_64_29),
            (191, 0xf9_8c_0a),
            (199, 0xfb_9b_06),
            (206, 0xfc_a8_0d),
            (222, 0xf9_c7_2f),
            (235, 0xf4_e1_56),
            (246, 0xf2_f4_82),
            (255, 0xfc_ff_a4),
        ],
    },
    ColorMap {
        name: "plasma",
        about: "perceptually uniform, blue to yellow, bright",
        points: &[
            (0, 0x0d_08_87),
            (4, 0x19_06_8c),
            (23, 0x3e_04_9c),
            (50, 0x69_00_a8),
            (67, 0x83_05_a7),
            (88, 0xa0_1a_9c),
            (127, 0xcb_46_79),
            (173, 0xef_7c_51),
            (207, 0xfd_ab_33),
            (229, 0xfc_cd_25),
            (251, 0xf2_f2_27),
            (255, 0xf0_f9_21),
        ],
    },
    ColorMap {
        name: "cividis",
        about: "like viridis, also for colour-blind viewers",
        points: &[
            (0, 0x00_22_4e),
            (18, 0x00_2f_6d),
            (23, 0x01_32_71),
            (24, 0x05_33_71),
            (30, 0x16_37_70),
            (44, 0x2d_41_6d),
            (76, 0x4f_57_6c),
            (134, 0x82_80_79),
            (178, 0xad_a2_72),
            (215, 0xd4_c1_5f),
            (238, 0xee_d6_49),
            (251, 0xfd_e3_34),
            (255, 0xfe_e8_38),
        ],
    },
    ColorMap {
        name: "turbo",
        about: "rainbow without false edges",
        points: &[
            (0, 0x30_12_3b),
            (5, 0x36_21_5f),
            (13, 0x3e_38_91),
            (22, 0x44_51_bf),
            (30, 0x46_66_dd),
            (38, 0x47_7b_f2),
            (45, 0x45_8c_fd),
            (51, 0x3e_9b_fe),
            (60, 0x2f_b2_f4),
            (72, 0x1c_cd_d8),
            (81, 0x18_de_c0),
            (87, 0x1d_e7_b2),
            (94, 0x2c_f0_9e),
            (106, 0x55_fa_76),
            (120, 0x8b_ff_4b),
            (129, 0xa7_fc_3a),
            (139, 0xc1_f3_34),
            (156, 0xe7_d7_39),
            (168, 0xf8_be_39),
            (180, 0xfe_a1_30),
            (193, 0xfa_7b_1f),
            (209, 0xea_4e_0d),
            (225, 0xce_2d_04),
            (241, 0xa7_14_01),
            (255, 0x7a_04_03),
        ],
    },
    ColorMap {
        name: "coolwarm",
        about: "diverging, blue over grey to red",
        points: &[
            (0, 0x3b_4c_c0),
            (7, 0x43_58_cb),
            (31, 0x61_80_e9),
            (55, 0x81_a4_fb),
            (79, 0xa2_c1_ff),
            (104, 0xc3_d5_f4),
            (126, 0xdb_dc_de),
            (137, 0xe6_d7_cf),
            (158, 0xf4_c6_af),
            (182, 0xf7_a8_89),
            (207, 0xec_7f_63),
            (232, 0xd4_4e_41),
            (247, 0xc0_28_2f),
            (255, 0xb4_04_26),
        ],
    },
    ColorMap { name: "grey", about: "black to white", points: &[(0, 0x00_00_00), (255, 0xff_ff_ff)] },
];

/// The map of this name.
pub fn find(name: &str) -> Option<&'static ColorMap> {
    MAPS.iter().find(|map| map.name == name)
}
