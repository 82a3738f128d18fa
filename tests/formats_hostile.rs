//! Hostile files: refused or read as `expect.json` says, quickly and without large allocations. One test alone in its process,
//! because it watches the allocator.
#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used)] // In helpers of tests as well.
#![allow(unsafe_code)] // A global allocator that counts cannot be written otherwise.

mod formats_small;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

use formats_small::shared;
use olbvh::Error;
use olbvh::formats::{Fate, LoadOptions, load};

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is handed to the system's allocator unchanged; the counters do not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(now, Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn hostile_files() {
    let Some(root) = shared("hostile") else { return };
    let expected: serde_json::Value = serde_json::from_slice(&std::fs::read(root.join("expect.json")).unwrap()).unwrap();
    let expected = expected.as_object().unwrap();
    let mut broken = Vec::new();
    for (name, expect) in expected {
        let path = root.join(name);
        let size = std::fs::metadata(&path).unwrap().len() as usize;
        PEAK.store(NOW.load(Relaxed), Relaxed);
        let (before, start) = (NOW.load(Relaxed), Instant::now());
        let result = load(&path, &LoadOptions::default());
        let (seconds, peak) = (start.elapsed().as_secs_f64(), PEAK.load(Relaxed) - before);
        let mut complain = |what: String| broken.push(format!("{name}: {what}"));
        if seconds > 5.0 {
            complain(format!("{seconds:.1} s"));
        }
        if peak > (64 << 20) + 100 * size {
            complain(format!("{} MiB for {size} bytes", peak >> 20));
        }
        let want = expect["expect"].as_str().unwrap();
        match result {
            Ok(_) if want == "error" => complain("accepted".into()),
            Err(error) if want == "ok" => complain(format!("refused: {error}")),
            Ok(loaded) => {
                let cells = u64::from(loaded.mesh.source_cells) - loaded.report.count(Fate::Boundary);
                let negative = loaded.report.negative;
                for (key, found) in [("points", loaded.report.points), ("cells", cells), ("negative", negative)] {
                    if expect[key].as_u64().is_some_and(|n| n != found) {
                        complain(format!("{found} {key}, not {}", expect[key]));
                    }
                }
                let used = loaded.mesh.tets.as_flattened();
                if used.iter().any(|&v| loaded.mesh.points[v as usize].iter().any(|x| !x.is_finite())) {
                    complain("a used point is not finite".into());
                }
            }
            Err(error) => {
                let text = error.to_string();
                let stem = name.rsplit(['/', '.']).nth(1).unwrap();
                if !matches!(error, Error::File { .. } | Error::Io { .. }) || !text.contains(stem) {
                    complain(format!("the message does not name the file: {text}"));
                }
                if text.len() > 600 || text.chars().any(char::is_control) {
                    complain(format!("unprintable or endless message: {text}"));
                }
            }
        }
    }
    assert!(broken.is_empty(), "{} of {}:\n{}", broken.len(), expected.len(), broken.join("\n"));
}
