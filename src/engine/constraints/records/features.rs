//! Features of a scene's constraints; unused ones are not compiled in.

use crate::bodies::BodyKind;

/// Features that the contacts of a scene use, determined as bodies are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Features {
    /// Some contact can turn a body. False if every dynamic body consists of discs about its center of
    /// mass, nothing spins at the start and there is no friction.
    pub rotation: bool,
    /// Some pair of surfaces has a friction coefficient above zero.
    pub friction: bool,
    /// Some surface bounces.
    pub restitution: bool,
    /// Some pair of shapes can touch at two points.
    pub two_points: bool,
    /// Some body is damped.
    pub damping: bool,
}

impl Features {
    /// All features.
    pub const FULL: Features =
        Features { rotation: true, friction: true, restitution: true, two_points: true, damping: true };

    /// No features.
    pub const NONE: Features =
        Features { rotation: false, friction: false, restitution: false, two_points: false, damping: false };

    /// Features of either scene.
    pub fn union(self, other: Features) -> Features {
        Features {
            rotation: self.rotation || other.rotation,
            friction: self.friction || other.friction,
            restitution: self.restitution || other.restitution,
            two_points: self.two_points || other.two_points,
            damping: self.damping || other.damping,
        }
    }
}

/// The features that change the code of a sweep, as compile-time constants.
///
/// Restitution and damping are passes of their own, so sweeps do not depend on them.
pub trait KernelFeatures: Copy + 'static {
    /// [`Features::rotation`]
    const ROTATION: bool;
    /// [`Features::friction`]
    const FRICTION: bool;
    /// Points of a contact: 1 or 2.
    const POINTS: usize;

    /// The layout of this kernel's records for this kind of body a.
    fn layout(partner: PartnerKind) -> Layout {
        Layout::new(Self::ROTATION, Self::FRICTION, Self::POINTS, partner != PartnerKind::Static)
    }
}

/// [`KernelFeatures::layout`] as a value.
pub type LayoutOf = fn(PartnerKind) -> Layout;

/// The features of one kernel, as a type.
#[derive(Clone, Copy, Debug)]
pub struct Kernel<const ROTATION: bool, const FRICTION: bool, const POINTS: usize>;

impl<const R: bool, const F: bool, const P: usize> KernelFeatures for Kernel<R, F, P> {
    const ROTATION: bool = R;
    const FRICTION: bool = F;
    const POINTS: usize = P;
}

/// Kind of body a of a contact; body b is dynamic.
pub trait Partner: Copy + 'static {
    /// Whether body a can have a velocity and move, so that its row is gathered.
    const HAS_ROW: bool;
}

/// A moving body. Whether impulses change its velocity is known per segment ([`PartnerKind`]): the row of
/// a dynamic body is written back; that of a kinematic body, with inverse masses of zero, is not.
#[derive(Clone, Copy, Debug)]
pub struct OnMoving;
/// A static body.
#[derive(Clone, Copy, Debug)]
pub struct OnStatic;

impl Partner for OnMoving {
    const HAS_ROW: bool = true;
}
impl Partner for OnStatic {
    const HAS_ROW: bool = false;
}

/// [`Partner`] as a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartnerKind {
    /// A dynamic body: impulses change its velocity.
    Dynamic,
    /// A kinematic body: it moves, but impulses do not change its velocity.
    Kinematic,
    /// A static body: no row is read or written for it.
    Static,
}

impl PartnerKind {
    /// All kinds.
    pub const ALL: [PartnerKind; 3] = [PartnerKind::Dynamic, PartnerKind::Kinematic, PartnerKind::Static];

    /// The kind of a body.
    pub(crate) fn of(body: BodyKind) -> Self {
        match body {
            BodyKind::Dynamic => PartnerKind::Dynamic,
            BodyKind::Kinematic => PartnerKind::Kinematic,
            BodyKind::Static => PartnerKind::Static,
        }
    }
}

/// Offset of each quantity in a constraint record, in lane vectors.
///
/// A record holds one batch of `W` contacts: `stride` vectors of `W` floats, back to back. Quantities that
/// the kernel does not use are not stored. Per contact: normal, friction. Per point: the angular arms
/// `r × n` and `r × t` of both bodies, separation, effective masses, accumulated impulses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Points per contact.
    pub points: usize,
    /// Friction coefficient.
    pub friction: usize,
    /// First point. The normal is at 0 and 1.
    pub first_point: usize,
    /// Distance from one point to the next.
    pub point_stride: usize,
    /// Within a point: `r_b × n`, then `r_b × t`.
    pub arm_b: usize,
    /// Within a point: `r_a × n`, then `r_a × t`.
    pub arm_a: usize,
    /// Within a point: separation at the start of the step.
    pub separation: usize,
    /// Within a point: normal effective mass.
    pub normal_mass: usize,
    /// Within a point: accumulated normal impulse.
    pub normal_impulse: usize,
    /// Within a point: tangential effective mass.
    pub tangent_mass: usize,
    /// Within a point: accumulated tangential impulse.
    pub tangent_impulse: usize,
    /// Vectors in a record.
    pub stride: usize,
    /// Whether the tangential quantities are stored.
    pub has_friction: bool,
    /// Whether the arms of body b, and those of body a, are stored.
    pub has_arms: [bool; 2],
    /// Whether body a has a row to gather.
    pub a_has_row: bool,
}

impl Layout {
    /// The layout for these features. `a_has_row`: body a has a row to gather.
    pub const fn new(rotation: bool, friction: bool, points: usize, a_has_row: bool) -> Layout {
        let arm_b = 0;
        let arm_a = if rotation { 2 } else { 0 };
        let separation = arm_a + if rotation && a_has_row { 2 } else { 0 };
        let normal_mass = separation + 1;
        let normal_impulse = separation + 2;
        let tangent_mass = separation + 3;
        let tangent_impulse = separation + 4;
        let point_stride = separation + if friction { 5 } else { 3 };
        let first_point = if friction { 3 } else { 2 };
        Layout {
            points,
            friction: 2,
            first_point,
            point_stride,
            arm_b,
            arm_a,
            separation,
            normal_mass,
            normal_impulse,
            tangent_mass,
            tangent_impulse,
            stride: first_point + points * point_stride,
            has_friction: friction,
            has_arms: [rotation, rotation && a_has_row],
            a_has_row,
        }
    }

    /// The layout of a kernel.
    pub const fn of<N: KernelFeatures, O: Partner>() -> Layout {
        Layout::new(N::ROTATION, N::FRICTION, N::POINTS, O::HAS_ROW)
    }

    /// The layout for features that are known at run time.
    pub fn for_features(features: &Features, partner: PartnerKind) -> Layout {
        let points = if features.two_points { 2 } else { 1 };
        Layout::new(features.rotation, features.friction, points, partner != PartnerKind::Static)
    }

    /// Number of floats for the arms of a point.
    pub fn arms(&self) -> usize {
        2 * self.has_arms.iter().filter(|&&has| has).count()
    }

    /// Offset of a quantity of point `p`.
    #[inline(always)]
    pub const fn at(&self, p: usize, quantity: usize) -> usize {
        self.first_point + p * self.point_stride + quantity
    }

    /// Bytes per contact: its share of the record, and the body indices.
    pub const fn bytes(&self, partner: PartnerKind) -> usize {
        4 * self.stride + if matches!(partner, PartnerKind::Static) { 4 } else { 8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_do_not_overlap_and_fill_the_record() {
        for rotation in [false, true] {
            for friction in [false, true] {
                for points in [1, 2] {
                    for has_row in [false, true] {
                        let l = Layout::new(rotation, friction, points, has_row);
                        let mut used = vec![0, 1];
                        if friction {
                            used.push(l.friction);
                        }
                        for p in 0..points {
                            if rotation {
                                used.extend([l.at(p, l.arm_b), l.at(p, l.arm_b) + 1]);
                            }
                            if rotation && has_row {
                                used.extend([l.at(p, l.arm_a), l.at(p, l.arm_a) + 1]);
                            }
                            used.extend([l.separation, l.normal_mass, l.normal_impulse].map(|q| l.at(p, q)));
                            if friction {
                                used.extend([l.tangent_mass, l.tangent_impulse].map(|q| l.at(p, q)));
                            }
                        }
                        used.sort_unstable();
                        assert_eq!(used, (0..l.stride).collect::<Vec<_>>());
                    }
                }
            }
        }
    }

    #[test]
    fn a_two_point_manifold_costs_92_bytes_and_a_bare_disc_28() {
        let full = Layout::for_features(&Features::FULL, PartnerKind::Dynamic);
        assert_eq!(full.bytes(PartnerKind::Dynamic), 92);
        let on_ground = Layout::for_features(&Features::FULL, PartnerKind::Static);
        assert_eq!(on_ground.bytes(PartnerKind::Static), 72);
        let bare = Layout::for_features(&Features::NONE, PartnerKind::Dynamic);
        assert_eq!(bare.bytes(PartnerKind::Dynamic), 28);
    }
}
