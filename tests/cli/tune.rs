//! `olbvh tune`, and how later runs find the profile that it saved.

use olbvh::tune::Profile;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder with its own configuration.
struct Home(tempfile::TempDir);

impl Home {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn olbvh(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_olbvh"));
        command.args(arguments).current_dir(self.0.path()).env_remove("OLBVH_TARGET").env_remove("OLBVH_NO_PROFILE");
        command.env("XDG_CONFIG_HOME", self.path("config")).envs(variables.iter().copied()).output().unwrap()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let out = self.olbvh(&[arguments, &["--json"]].concat(), &[]);
        assert_eq!(out.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
        serde_json::from_slice(&out.stdout).unwrap()
    }

    /// The path of the profile of the device that a run of `tune` tells of.
    fn profile(&self, told: &Value) -> PathBuf {
        let devices = olbvh::gpu::list_devices().unwrap();
        let device = devices.iter().find(|d| told["device"] == d.name.as_str() && told["driver"] == d.driver.as_str()).unwrap();
        self.path("config/olbvh").join(Profile::file_name(device))
    }

    /// The line of `info -v` about the kernels, and its remarks.
    fn kernels(&self, arguments: &[&str], variables: &[(&str, &str)]) -> (String, String) {
        let out = self.olbvh(&[&["info", "kuhn:2,2,2", "-v"], arguments].concat(), variables);
        let [stdout, stderr] = [out.stdout, out.stderr].map(|text| String::from_utf8(text).unwrap());
        assert_eq!(out.status.code(), Some(0), "{stderr}");
        let line = stdout.lines().find(|line| line.trim_start().starts_with("kernels ")).unwrap().to_owned();
        (line, stderr)
    }
}

fn write(path: &Path, profile: &Value) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, profile.to_string()).unwrap();
}

#[test]
fn a_search_saves_what_it_gained() {
    let home = Home::new();
    let told = home.json(&["tune", "kuhn:5,5,5,jitter=0.3", "--seconds", "2", "--no-profile"]);
    let [tried, refused, kept] = ["tried", "refused", "kept"].map(|key| told[key].as_u64().unwrap());
    assert!(tried > 0 && refused == 0, "{told:#}");
    if kept == 0 {
        assert!(told["file"].is_null() && told["profile"].is_null() && told["before"] == told["after"], "{told:#}");
        assert!(!home.profile(&told).exists());
        return;
    }
    let file = PathBuf::from(told["file"].as_str().unwrap());
    assert_eq!(file, home.profile(&told));
    assert_eq!(told["profile"], told["file"]);
    let saved: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!((&saved["gains"], &saved["device"]), (&told["gains"], &told["device"]));
    assert_eq!(told["gains"].as_array().unwrap().last().unwrap()["stage"], "all");
    assert!(told["before"] != told["after"]);
    assert!(home.kernels(&[], &[]).0.contains(file.to_str().unwrap()));
}

#[test]
fn profiles_are_found_and_passed_over() {
    let home = Home::new();
    let tune = ["tune", "kuhn:3,3,3", "--seconds", "0"];
    let told = home.json(&[&tune[..], &["-o", "mine.json"]].concat());
    assert_eq!((&told["tried"], &told["kept"]), (&0.into(), &0.into()));
    assert_eq!((&told["file"], &told["profile"]), (&"mine.json".into(), &"mine.json".into()));
    let told = home.json(&tune);
    assert!(told["file"].is_null() && told["profile"].is_null(), "{told:#}");
    let file = home.profile(&told);
    assert!(!file.exists());
    assert!(home.kernels(&[], &[]).0.contains("for devices of this kind"));

    // The profile of this device.
    let mut profile: Value = serde_json::from_slice(&std::fs::read(home.path("mine.json")).unwrap()).unwrap();
    let named = |profile: &mut Value, key: &str, value: Value| profile["target"][key] = value;
    named(&mut profile, "name", "mine".into());
    write(&file, &profile);
    let path = file.to_str().unwrap();
    let (line, remarks) = home.kernels(&[], &[]);
    assert!(line.contains("`mine`, from") && line.contains(path) && !remarks.contains("ignored"), "{line} {remarks}");
    let devices = home.olbvh(&["devices", "-v"], &[]);
    assert!(String::from_utf8_lossy(&devices.stdout).contains(path));
    for (arguments, variables) in [(&["--no-profile"][..], &[][..]), (&[], &[("OLBVH_NO_PROFILE", "1")])] {
        assert!(home.kernels(arguments, variables).0.contains("for devices of this kind"));
    }
    assert!(home.kernels(&[], &[("OLBVH_NO_PROFILE", "0")]).0.contains("`mine`"));

    // The profile of another device, and broken ones, cost only speed: a remark names the file and a remedy.
    let mut foreign = profile.clone();
    foreign["driver"] = "Another 1.0".into();
    let mut narrow = profile.clone();
    named(&mut narrow, "each", 3.into());
    let mut unknown = profile.clone();
    named(&mut unknown, "colour", 3.into());
    let mut short = profile.clone();
    short["target"]["run"]["rows"] = 1.into();
    let wrong = [
        (foreign, "made for the driver `Another 1.0`"),
        (narrow.clone(), "each is 3"),
        (short, "run.rows is 1; for large meshes"),
        (unknown, "colour"),
        (Value::Null, "null"),
    ];
    for (wrong, what) in wrong {
        write(&file, &wrong);
        let (line, remarks) = home.kernels(&[], &[]);
        assert!(line.contains("for devices of this kind"), "{line}");
        assert!(remarks.contains("profile ignored") && remarks.contains(path) && remarks.contains(what), "{remarks}");
        assert!(remarks.contains("remove it, or"), "{remarks}");
    }
    for arguments in [&tune[..], &["devices"], &["devices", "-v"]] {
        let remarks = String::from_utf8(home.olbvh(arguments, &[]).stderr).unwrap();
        assert_eq!(remarks.matches("profile ignored").count(), 1, "{arguments:?}: {remarks}");
    }

    // A target that is asked for must exist, and takes precedence over the profile.
    write(&file, &profile);
    assert!(home.kernels(&["--target", "mine.json"], &[]).0.contains("from mine.json"));
    assert!(home.kernels(&[], &[("OLBVH_TARGET", "amd")]).0.contains("`amd`, as asked for"));
    assert!(home.kernels(&[], &[("OLBVH_TARGET", "")]).0.contains("`mine`"), "an empty variable counts as unset");
    let unknown = home.olbvh(&["info", "kuhn:2,2,2"], &[("OLBVH_TARGET", "bogus")]);
    let message = String::from_utf8_lossy(&unknown.stderr);
    assert!(unknown.status.code() == Some(2) && message.contains("OLBVH_TARGET: unknown target `bogus`"), "{message}");
    let unknown = home.olbvh(&["devices", "-v"], &[("OLBVH_TARGET", "bogus")]);
    let message = String::from_utf8_lossy(&unknown.stderr);
    assert!(unknown.status.code() == Some(2) && message.contains("OLBVH_TARGET: unknown target `bogus`"), "{message}");
    write(&home.path("narrow.json"), &narrow);
    write(&home.path("broken.json"), &Value::Null);
    for (target, code) in [("nvida", 2), ("narrow.json", 2), ("broken.json", 3), ("nothing.json", 3)] {
        // A file may suit some of the devices, so a list of devices says which it does not suit.
        let narrow = target == "narrow.json";
        for (command, code) in [(&["info", "kuhn:2,2,2"][..], code), (&["devices"], if narrow { 0 } else { code })] {
            let out = home.olbvh(&[command, &["--target", target]].concat(), &[]);
            let [told, message] = [&out.stdout, &out.stderr].map(|text| String::from_utf8_lossy(text));
            assert_eq!(out.status.code(), Some(code), "{target}: {message}");
            let message = if code == 0 { told } else { message };
            assert!(message.contains("--target: ") && message.contains(target), "{message}");
        }
    }
}

#[test]
fn wrong_arguments_are_refused() {
    let home = Home::new();
    let wrong: [&[&str]; 5] = [&["--seconds=-1"], &["--seconds", "-3"], &["-o", "a.txt"], &["--device", "cpu"], &["kuhn:0,1,1"]];
    for arguments in wrong {
        let out = home.olbvh(&[&["tune"], arguments].concat(), &[]);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
    }
    assert!(std::fs::read_dir(home.0.path()).unwrap().next().is_none(), "a refused run leaves nothing");
}
