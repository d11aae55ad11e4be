//! CPU features that this build does not use.

use super::{native_width, target_features};

/// One line that names the vector instructions that this CPU has and this build does not use, and the line to add;
/// none if the build uses all of them.
///
/// Cargo does not pass the build flags of a library on to its users, and a plain build for x86-64 uses SSE2 only: 4
/// lanes where a recent CPU has 16. Looks at the CPU once, in nanoseconds.
///
/// ```
/// # use simpulse_engine as simpulse;
/// if let Some(line) = simpulse::engine::lanes::unused_cpu_features() {
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

/// The widest instructions that the CPU has, named as in [`target_features`], and their lanes.
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

/// Elsewhere a plain build uses what every CPU has.
#[cfg(not(target_arch = "x86_64"))]
fn widest() -> Option<(&'static str, usize)> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::lanes::LaneWidth;

    /// A build for this CPU has nothing to say, and one for fewer lanes names both and the line to add.
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
