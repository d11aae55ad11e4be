//! Mass, center and inertia.

use glam::DVec2;
use std::f64::consts::TAU;

/// Mass (kg), center of mass (m) and inertia about that center (kg·m²).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MassProperties {
    /// Mass (kg).
    pub mass: f64,
    /// Center of mass (m), in the frame of the shape.
    pub center: [f64; 2],
    /// Inertia about `center` (kg·m²).
    pub inertia: f64,
}

impl MassProperties {
    /// No mass, at the origin.
    pub const ZERO: MassProperties = MassProperties { mass: 0.0, center: [0.0; 2], inertia: 0.0 };

    pub(super) fn new(mass: f64, center: DVec2, inertia: f64) -> Self {
        Self { mass, center: center.to_array(), inertia }
    }
}

/// Combines several parts into one body. With the center c = Σ mᵢcᵢ / Σ mᵢ, the parallel axis theorem moves
/// each inertia: I = Σ Iᵢ + mᵢ|cᵢ − c|². Returns [`MassProperties::ZERO`] if the parts have no mass.
pub fn combine(parts: &[MassProperties]) -> MassProperties {
    let mass: f64 = parts.iter().map(|p| p.mass).sum();
    if mass <= 0.0 {
        return MassProperties::ZERO;
    }
    let center = parts.iter().map(|p| p.mass * DVec2::from(p.center)).sum::<DVec2>() / mass;
    let moved = |p: &MassProperties| p.inertia + p.mass * (DVec2::from(p.center) - center).length_squared();
    MassProperties::new(mass, center, parts.iter().map(moved).sum())
}

/// Mass properties of a hull of two or more vertices, counter-clockwise, grown by r.
///
/// Growing adds to the core one rectangle of ℓ × r per edge and one disc sector per vertex, whose angle θ is
/// the turn there (they sum to 2π):
/// - triangle (0, p, q) of the fan: area ½ p×q, centroid (p + q)/3, inertia
///   about the apex m (p·p + p·q + q·q)/6;
/// - rectangle: inertia about its center m (ℓ² + r²)/12;
/// - sector: mass ρ θ r²/2, inertia about the apex m r²/2, centroid at
///   c = (2r/3) sin(θ/2)/(θ/2) along the bisector.
///
/// A capsule is the case of two vertices: no core, two half discs.
pub(super) fn rounded_hull_mass(core: &[DVec2], r: f64, density: f64) -> MassProperties {
    let n = core.len();
    let mut parts = Vec::with_capacity(3 * n);
    // Parallel axis theorem, for a centroid at offset c from the apex.
    let part = |mass: f64, apex: DVec2, c: DVec2, inertia_about_apex: f64| {
        MassProperties::new(mass, apex + c, inertia_about_apex - mass * c.length_squared())
    };
    for i in 1..n - 1 {
        let (p, q) = (core[i] - core[0], core[i + 1] - core[0]);
        let mass = density * 0.5 * p.perp_dot(q);
        parts.push(part(mass, core[0], (p + q) / 3.0, mass * (p.dot(p) + p.dot(q) + q.dot(q)) / 6.0));
    }
    for i in 0..n {
        let (previous, v, next) = (core[(i + n - 1) % n], core[i], core[(i + 1) % n]);
        let (before, normal) = (outward(previous, v), outward(v, next));
        let length = v.distance(next);
        let mass = density * length * r;
        let center = 0.5 * (v + next) + 0.5 * r * normal;
        parts.push(MassProperties::new(mass, center, mass * (length * length + r * r) / 12.0));

        // In (0, 2π): `atan2` may return −π for a turn of exactly π.
        let angle = before.perp_dot(normal).atan2(before.dot(normal)).rem_euclid(TAU);
        let mass = density * 0.5 * angle * r * r;
        let reach = 4.0 * r / (3.0 * angle) * (0.5 * angle).sin();
        let bisector = DVec2::from_angle(0.5 * angle).rotate(before);
        parts.push(part(mass, v, reach * bisector, 0.5 * mass * r * r));
    }
    combine(&parts)
}

/// Outward unit normal of the edge p → q of a counter-clockwise polygon.
pub(super) fn outward(p: DVec2, q: DVec2) -> DVec2 {
    -(q - p).perp().normalize()
}
