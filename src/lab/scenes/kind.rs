//! Kinds of scenes: what moves in them, as the answer of a study lists them.

/// Kind of a scene of the catalog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// Bodies that must stay on top of each other.
    Stacks,
    /// Many bodies in no order.
    Piles,
    /// Light bodies that carry heavy ones.
    HeavyOnLight,
    /// Flights and impacts.
    Fast,
    /// Bodies held by joints.
    Joints,
    /// Friction and rolling.
    Sliding,
}

impl SceneKind {
    /// Every kind.
    pub const ALL: [SceneKind; 6] = [
        SceneKind::Stacks,
        SceneKind::Piles,
        SceneKind::HeavyOnLight,
        SceneKind::Fast,
        SceneKind::Joints,
        SceneKind::Sliding,
    ];

    /// Words for tables.
    pub fn words(self) -> &'static str {
        match self {
            SceneKind::Stacks => "stacks",
            SceneKind::Piles => "piles",
            SceneKind::HeavyOnLight => "heavy on light",
            SceneKind::Fast => "fast",
            SceneKind::Joints => "joints",
            SceneKind::Sliding => "sliding",
        }
    }

    /// Scenes of the catalog that show it, for a study without one.
    pub fn examples(self) -> &'static str {
        match self {
            SceneKind::Stacks => "stack:20,pyramid,arch",
            SceneKind::Piles => "circle_pile:500,junkyard",
            SceneKind::HeavyOnLight => "mass_ratio,high_mass_ratio_1",
            SceneKind::Fast => "bounce,oblique_collision",
            SceneKind::Joints => "ball_and_chain,hanging_chain,ragdolls",
            SceneKind::Sliding => "incline_slip,friction_ramp",
        }
    }

    /// The kind of a scene of the catalog, by its name with or without size and seed; `None` for other scenes.
    pub fn of(name: &str) -> Option<Self> {
        Some(match name.split([':', '@']).next().unwrap_or(name) {
            "disc_column" | "stack" | "vertical_stack" | "circle_stack" | "far_stack"
            | "overlap_recovery" | "pyramid" | "large_pyramid" | "many_pyramids" | "arch" | "card_house" => {
                SceneKind::Stacks
            }
            "washer" | "tumbler" | "junkyard" | "compounds" | "circle_pile" => SceneKind::Piles,
            "mass_ratio" | "high_mass_ratio_1" | "high_mass_ratio_2" => SceneKind::HeavyOnLight,
            "free_fall" | "free_spin" | "bounce" | "bounce_elastic" | "oblique_collision" | "single_box"
            | "double_domino" | "smash" => SceneKind::Fast,
            "bridge" | "ball_and_chain" | "stretched_chain" | "far_chain" | "cantilever"
            | "hanging_chain" | "pendulum" | "double_pendulum" | "four_bar" | "cradle" | "vehicle"
            | "crane" | "joint_grid" | "spinner" | "falling_hinges" | "ragdolls" | "rain" => {
                SceneKind::Joints
            }
            "incline_stick" | "incline_slip" | "rolling_incline" | "slipping_disc" | "sliding_stop"
            | "slide_to_roll" | "friction_ramp" => SceneKind::Sliding,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::{CATALOG, load};

    #[test]
    fn every_scene_of_the_catalog_has_a_kind_and_joints_are_joints() {
        for entry in CATALOG {
            let kind = SceneKind::of(entry.name);
            let joined = !load(entry.name).unwrap().scene.joints.is_empty();
            assert!(kind.is_some(), "{}", entry.name);
            assert_eq!(kind == Some(SceneKind::Joints), joined, "{}", entry.name);
        }
        for kind in SceneKind::ALL {
            assert!(kind.examples().split(',').all(|name| SceneKind::of(name) == Some(kind)), "{kind:?}");
        }
        assert_eq!(SceneKind::of("stack_of_mine.json"), None);
    }
}
