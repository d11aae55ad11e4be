//! The machine and the compiler of a result.

/// Description of machine and compiler, written with every result.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Environment {
    /// Model name of the processor.
    pub cpu: String,
    /// Processors that the run could use.
    pub processors: usize,
    /// Version of the compiler that built the program.
    pub compiler: String,
    /// `x86_64`, …
    pub architecture: String,
    /// `linux`, …
    pub system: String,
    /// Instruction sets that the compiler was allowed to use. These decide how lanes are implemented, not the
    /// processor's instruction sets.
    pub target_features: Vec<String>,
    /// Widest lanes that one instruction of these sets can process.
    pub native_lanes: usize,
    /// Whether the program was built with debug assertions.
    pub debug_assertions: bool,
    /// Version of this crate.
    pub version: String,
    /// Commit that the program was built from, or `unknown`.
    pub commit: String,
}

impl Environment {
    /// The environment of this program on this machine.
    pub fn current() -> Self {
        Environment {
            cpu: cpu_model(),
            processors: std::thread::available_parallelism().map_or(1, |n| n.get()),
            compiler: env!("SIMPULSE_COMPILER").into(),
            architecture: std::env::consts::ARCH.into(),
            system: std::env::consts::OS.into(),
            target_features: target_features(),
            native_lanes: native_lanes(),
            debug_assertions: cfg!(debug_assertions),
            version: env!("CARGO_PKG_VERSION").into(),
            commit: env!("SIMPULSE_COMMIT").into(),
        }
    }
}

impl Environment {
    /// What decides the bits of results and which lanes are native: `with 16 lanes, fused multiply-adds`.
    pub fn build(&self) -> String {
        let fused = self.target_features.iter().any(|name| name == "fma") || self.architecture == "aarch64";
        let rounding = if fused { "fused multiply-adds" } else { "separately rounded multiply-adds" };
        format!("with {} lanes, {rounding}", self.native_lanes)
    }

    /// Name of the widest instruction set that the compiler was allowed to use.
    pub fn instructions(&self) -> &'static str {
        let names = [
            ("avx512f", "AVX-512"),
            ("avx2", "AVX2"),
            ("avx", "AVX"),
            ("sse2", "SSE2"),
            ("neon", "NEON"),
            ("simd128", "WebAssembly SIMD"),
        ];
        let has = |feature: &str| self.target_features.iter().any(|own| own == feature);
        names.into_iter().find(|(feature, _)| has(feature)).map_or("no SIMD", |(_, name)| name)
    }
}

fn cpu_model() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or("unknown".to_string(), |(_, name)| name.trim().to_string())
}

fn target_features() -> Vec<String> {
    macro_rules! enabled {
        ($($name:literal),*) => { [$(($name, cfg!(target_feature = $name))),*] };
    }
    let all = enabled!(
        "sse2", "sse4.1", "avx", "avx2", "fma", "avx512f", "avx512vl", "avx512dq", "neon", "simd128"
    );
    all.into_iter().filter(|f| f.1).map(|f| f.0.to_string()).collect()
}

fn native_lanes() -> usize {
    if cfg!(target_feature = "avx512f") {
        16
    } else if cfg!(target_feature = "avx") {
        8
    } else if cfg!(any(target_feature = "sse2", target_feature = "neon", target_feature = "simd128")) {
        4
    } else {
        1
    }
}
