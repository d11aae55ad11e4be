//! CPU features that this build does not use.

use super::{native_width, target_features};

/// A one-line message naming the vector instructions that this CPU has and this build does not use, with the
/// configuration line to add. `None` if the build uses all of them.
///
/// Cargo does not pass the build flags of a library on to its users, and a plain build for x86-64 uses only
/// SSE2: 4 lanes, where a recent CPU has 16. Checks the CPU once, in nanoseconds.
///
/// ```
/// if let Some(line) = simpulse_engine::lanes::unused_cpu_features() {
///     eprintln!("{line}");
/// }
/// ```
pub fn unused_cpu_features() -> Option<String> {
    let (name, lanes) = widest()?;
    let built = native_width().lanes();
    (lanes > built || name != target_features() && lanes == built).then(|| {
        format!(
            "this CPU has {name} ({lanes} lanes), this build uses {} ({built} lanes): add \
             `build.rustflags = [\"-C\", \"target-cpu=native\"]` to .cargo/config.toml",
            target_features()
        )
    })
}

/// The widest vector instructions of the CPU, named as in [`target_features`], and their lanes.
#[cfg(target_arch = "x86_64")]
fn widest() -> Option<(&'static str, usize)> {
    if is_x86_feature_detected!("avx512f") {
        Some(("avx512f+fma", 16))
    } else if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        Some(("avx2+fma", 8))
    } else if is_x86_feature_detected!("avx") {
        Some(("avx", 8))
    } else {
        None
    }
}

/// On other architectures a plain build uses the vector instructions that every CPU has.
#[cfg(not(target_arch = "x86_64"))]
fn widest() -> Option<(&'static str, usize)> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LaneWidth;

    /// `None` in a build for this CPU. In a build with fewer lanes, the message names both widths and the
    /// line to add.
    #[test]
    fn says_what_a_build_leaves_unused() {
        let Some((name, lanes)) = widest() else { return };
        match unused_cpu_features() {
            None => {
                assert!(name == target_features() && LaneWidth::from_lanes(lanes) == Some(native_width()))
            }
            Some(line) => {
                assert!(native_width().lanes() < lanes || name != target_features(), "{line}");
                assert!(line.contains(name) && line.contains("target-cpu=native"), "{line}");
                assert_eq!(line.lines().count(), 1);
            }
        }
    }
}
