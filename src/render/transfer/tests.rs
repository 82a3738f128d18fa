use super::*;

#[test]
fn maps_agree_with_their_published_tables() {
    // Entries 0, 64, 128, 200, 255 of the published 256-entry tables.
    let published = [
        ("viridis", [0x44_01_54, 0x3b_52_8b, 0x21_91_8c, 0x70_cf_57, 0xfd_e7_25]),
        ("magma", [0x00_00_04, 0x51_12_7c, 0xb7_37_79, 0xfd_98_69, 0xfc_fd_bf]),
        ("inferno", [0x00_00_04, 0x57_10_6e, 0xbc_37_54, 0xfb_9d_07, 0xfc_ff_a4]),
        ("plasma", [0x0d_08_87, 0x7e_03_a8, 0xcc_47_78, 0xfb_a1_39, 0xf0_f9_21]),
        ("cividis", [0x00_22_4e, 0x43_4e_6c, 0x7d_7c_78, 0xc4_b4_68, 0xfe_e8_38]),
        ("turbo", [0x30_12_3b, 0x28_bc_eb, 0xa4_fc_3c, 0xf4_66_17, 0x7a_04_03]),
        ("coolwarm", [0x3b_4c_c0, 0x8d_b0_fe, 0xdd_dc_dc, 0xf0_8b_6e, 0xb4_04_26]),
    ];
    for (name, entries) in published {
        let map = TransferFunction::named(name).unwrap();
        for (place, rgb) in [0.0f32, 64.0, 128.0, 200.0, 255.0].into_iter().zip(entries) {
            let [r, g, b, _] = map.at(place / 255.0);
            for (got, expected) in [r, g, b].into_iter().zip(from_hex(rgb)) {
                assert!((got - expected).abs() <= 2.0 / 255.0, "{name} at {place}: {got} {expected}");
            }
        }
    }
}

#[test]
fn every_map_is_a_function_and_can_be_reversed() {
    for map in maps::MAPS {
        let function = TransferFunction::from_map(map);
        TransferFunction::new(function.colors.clone(), DEFAULT_OPACITY.to_vec()).unwrap();
        assert_eq!((map.points[0].0, map.points[map.points.len() - 1].0), (0, 255), "{}", map.name);
        let reversed = TransferFunction::named(&format!("{}_r", map.name)).unwrap();
        for x in [0.0, 0.3, 0.9, 1.0] {
            let ([a, b, c, _], [d, e, f, _]) = (function.at(x), reversed.at(1.0 - x));
            assert!([a - d, b - e, c - f].iter().all(|v| v.abs() < 1e-5));
        }
    }
    assert!(TransferFunction::named("jet").unwrap_err().to_string().contains("viridis"));
}

#[test]
fn steps_ends_and_single_points() {
    let f = TransferFunction::new(vec![(0.5, [0.2; 3])], vec![(0.2, 0.0), (0.5, 0.0), (0.5, 1.0), (0.8, 0.0)]).unwrap();
    for (x, a) in [(0.0, 0.0), (0.49, 0.0), (0.5, 1.0), (0.65, 0.5), (0.8, 0.0), (1.0, 0.0)] {
        let [r, _, _, opacity] = f.at(x);
        assert!((opacity - a).abs() < 1e-5 && r == 0.2, "{x} {opacity}");
    }
    let end = TransferFunction::new(vec![(0.0, [0.0; 3]), (1.0, [1.0; 3])], vec![(0.0, 0.0), (1.0, 0.5), (1.0, 1.0)]).unwrap();
    assert_eq!(end.at(1.0), [1.0; 4]);
}

#[test]
fn opacity_texts() {
    assert_eq!(TransferFunction::parse_opacity("0.3").unwrap(), [(0.0, 0.3), (1.0, 0.3)]);
    assert_eq!(TransferFunction::parse_opacity("0:0, 1:0.5").unwrap(), [(0.0, 0.0), (1.0, 0.5)]);
    for text in ["", "a", "0:0,1", "0:0;1:1"] {
        assert!(TransferFunction::parse_opacity(text).is_err(), "{text}");
    }
    for bad in [vec![], vec![(0.0, 2.0)], vec![(0.5, 0.1), (0.2, 0.1)], vec![(f32::NAN, 0.0)]] {
        assert!(TransferFunction::default().with_opacity(bad).is_err());
    }
}

#[cfg(feature = "formats")]
#[test]
fn json_forms() {
    let f = TransferFunction::from_json(r##"{"colors": [[0, "#000000"], [1, [1, 0.5, 0]]], "opacity": [[0, 0], [1, 1]]}"##).unwrap();
    assert_eq!(f.at(0.5), [0.5, 0.25, 0.0, 0.5]);
    let f =
        TransferFunction::from_json(r#"{"colors": [[100, "000000"], [300, "ffffff"]], "opacity": [[200, 0.5]], "positions": "values"}"#)
            .unwrap();
    assert_eq!((f.range(), f.at(0.5)), (Some([100.0, 300.0]), [0.5; 4]));
    assert_eq!((f.over([200.0, 400.0]).at(0.25)[0], f.over([200.0, 200.0]).at(0.5)[0]), (0.75, 0.5));
    // Values may lie outside the range.
    let text = r#"{"colors": [[0, "000"], [500, "fff"]], "positions": "values", "range": [20, 95]}"#;
    let f = TransferFunction::from_json(text).unwrap();
    assert_eq!((f.at(0.0)[0], f.at(1.0)[0], f.over([0.0, 1000.0]).at(0.25)[0]), (0.04, 0.19, 0.5));
}

#[cfg(feature = "formats")]
#[test]
fn json_errors_say_what_is_wrong() {
    for (bad, why) in [
        ("", "the file is empty"),
        ("\n \n", "the file is empty"),
        ("{\"map\": \"grey\",\n \"opac", "line 2, column 6: the file ends in the middle"),
        ("{\"map\": grey}", "line 1, column 9: not valid JSON: expected value"),
        ("[]", "expected a JSON object such as"),
        ("{}", "neither \"map\" nor \"colors\" is given"),
        (r#"{"map": "grey", "colors": []}"#, "both \"map\" and \"colors\""),
        (r#"{"map": "jet"}"#, "no colour map `jet`"),
        (r#"{"map": "grey", "mode": 1}"#, "line 1, column 22: unknown field `mode`"),
        (r#"{"map": "grey", "range": [1, 1]}"#, "the range from 1 to 1 is empty"),
        (r#"{"map": "grey", "range": 5}"#, "\"range\" is 5, not [LO, HI]"),
        (r#"{"map": "grey", "opacity": [[100, 0], [300, 1]], "positions": "values"}"#, "needs \"colors\""),
        (r#"{"map": "grey", "opacity": [[0, 1], [1]]}"#, "point 2 of \"opacity\" is [1], not [PLACE, OPACITY]"),
        (r#"{"map": "grey", "opacity": [[0, 1], [1, 7]]}"#, "opacities of a transfer function: at place 1, the value 7 lies outside"),
        (r##"{"colors": [[0, "#123"], [1, "#12"]]}"##, "point 2 of \"colors\" is [1,\"#12\"], not [PLACE, COLOUR]"),
        (r#"{"colors": [[0, [1, 2]]]}"#, "point 1 of \"colors\" is [0,[1,2]], not"),
        (
            r##"{"colors": [[300, "#123"], [100, "#123"]], "positions": "values"}"##,
            "colours of a transfer function: values must ascend, but 100 follows 300",
        ),
        (r##"{"colors": [[1e99, "#123"]], "positions": "values"}"##, "the field's value inf is beyond single precision"),
        (r##"{"colors": [[5, "#123"]], "positions": "values"}"##, "the range from 5 to 5 is empty"),
        (r##"{"colors": [[1, "#123"], [0, "#123"]]}"##, "colours of a transfer function: places must ascend, but 0 follows 1"),
    ] {
        let error = TransferFunction::from_json(bad).unwrap_err().to_string();
        assert!(error.contains(why), "{bad}: {error}");
    }
}

#[test]
fn colours_and_maps_are_read_as_people_write_them() {
    for (text, color) in
        [("#fff", [1.0; 3]), ("FFFFFF", [1.0; 3]), (" #0080ff ", [0.0, 128.0 / 255.0, 1.0]), ("08f", [0.0, 136.0 / 255.0, 1.0])]
    {
        assert_eq!(parse_color(text), Some(color), "{text}");
    }
    for wrong in ["", "#", "##fff", "#ffff", "#ggg", "+12345", "#12345é"] {
        assert_eq!(parse_color(wrong), None, "{wrong}");
    }
    let [lower, upper] = ["viridis_r", "Viridis_R"].map(|name| TransferFunction::named(name).unwrap());
    assert_eq!(lower, upper);
}
