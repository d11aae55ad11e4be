//! Times of blocks in files: JSON has no NaN, so a block that was not run is `null`.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// For `#[serde(with)]`.
pub fn serialize<S: Serializer>(blocks: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    let pass = |times: &Vec<f64>| times.iter().map(|t| t.is_finite().then_some(*t)).collect();
    blocks.iter().map(pass).collect::<Vec<Vec<Option<f64>>>>().serialize(serializer)
}

/// For `#[serde(with)]`.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
    let passes = Vec::<Vec<Option<f64>>>::deserialize(deserializer)?;
    Ok(passes.into_iter().map(|pass| pass.into_iter().map(|t| t.unwrap_or(f64::NAN)).collect()).collect())
}
