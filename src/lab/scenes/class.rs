//! Classes of scenes: what a scene asks of a solver. A ranking says where it depends on them.

use super::Loaded;
use crate::engine::params::LINEAR_SLOP;
use crate::engine::solvers::{DEFAULT, find};
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::metrics::overlaps::Overlaps;

/// Class of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneClass {
    /// It starts at rest and must stay so.
    Placed,
    /// It is dropped, pushed, or starts overlapping, and must come to rest.
    Arrives,
    /// It need not come to rest.
    #[default]
    Moves,
}

impl SceneClass {
    /// Every class.
    pub const ALL: [SceneClass; 3] = [SceneClass::Placed, SceneClass::Arrives, SceneClass::Moves];

    /// Word for tables.
    pub fn word(self) -> &'static str {
        match self {
            SceneClass::Placed => "placed",
            SceneClass::Arrives => "arrives",
            SceneClass::Moves => "moves",
        }
    }

    /// The class of a scene. One that must come to rest is placed if at its start no body moves, each touches
    /// another or has a joint, and none overlap by more than the slop.
    ///
    /// Errors: a scene that cannot be built.
    pub fn of(loaded: &Loaded) -> Result<Self, Error> {
        if !loaded.rests() {
            return Ok(SceneClass::Moves);
        }
        let world = loaded.scene.build(Settings::new(find(DEFAULT)?))?;
        let slop = LINEAR_SLOP * world.settings.length_unit;
        let (mut held, mut flush) = (vec![false; world.bodies.len()], true);
        Overlaps::default().find(&world, |pair, manifold| {
            pair.into_iter().for_each(|shape| held[world.shape_body()[shape as usize] as usize] = true);
            flush &= manifold.points().iter().all(|point| point.separation >= -slop);
        });
        for (_, joint) in world.joints() {
            [joint.a, joint.b].into_iter().for_each(|body| held[body.index()] = true);
        }
        let still =
            |i: usize| world.bodies.velocity(i).length() == 0.0 && world.bodies.angular_velocity[i] == 0.0;
        let mut dynamic = (0..world.bodies.len()).filter(|&i| world.bodies.is_dynamic(i));
        let placed = flush && dynamic.all(|i| held[i] && still(i));
        Ok(if placed { SceneClass::Placed } else { SceneClass::Arrives })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::load;

    #[test]
    fn a_pile_is_placed_or_arrives() {
        let of = |name: &str| SceneClass::of(&load(name).unwrap()).unwrap();
        assert_eq!([of("arch"), of("hanging_chain")], [SceneClass::Placed, SceneClass::Moves]);
        assert_eq!([of("overlap_recovery"), of("vertical_stack")], [SceneClass::Arrives; 2]);
    }
}
