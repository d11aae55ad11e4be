//! Spring, motor and limits along one coordinate of a joint: an angle or a length.

use super::{Form, check_limits, check_not_negative};
use crate::bodies::def::finite;
use crate::constraints::joints::rows::{Jacobian, JointPass, RowLaw, spring_coefficients};
use crate::error::Error;
use crate::lanes::Lanes;

/// A damped spring.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Spring {
    /// Natural frequency of the two bodies on the spring, with what else the joint holds (Hz).
    pub hertz: f64,
    /// Damping ratio (1); 1 is critical.
    pub damping_ratio: f64,
    /// Coordinate at which the spring is relaxed (rad or m).
    #[cfg_attr(feature = "serde", serde(default))]
    pub rest: f64,
}

/// A motor with a target speed and bounded torque or force.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Motor {
    /// Target speed (rad/s or m/s).
    pub speed: f64,
    /// Maximum torque or force (N·m or N).
    pub max: f64,
}

impl Spring {
    /// Errors: a negative or non-finite value.
    pub fn check(&self) -> Result<(), Error> {
        check_not_negative("hertz", self.hertz)?;
        check_not_negative("damping_ratio", self.damping_ratio)?;
        finite("rest", self.rest)
    }

    /// `[S, D]`, see [`crate::constraints::joints::rows`].
    pub(super) fn coefficients(&self, h: f32) -> [f32; 2] {
        spring_coefficients(self.hertz as f32, self.damping_ratio as f32, h)
    }
}

/// The optional parts along one coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axial {
    pub spring: Option<Spring>,
    pub motor: Option<Motor>,
    pub limits: Option<[f64; 2]>,
}

impl Axial {
    pub fn form(self) -> Form {
        Form { spring: self.spring.is_some(), motor: self.motor.is_some(), limits: self.limits.is_some() }
    }

    pub fn check(self) -> Result<(), Error> {
        if let Some(spring) = self.spring {
            spring.check().map_err(|e| e.within("spring"))?;
        }
        if let Some(Motor { speed, max }) = self.motor {
            finite("speed", speed).and(check_not_negative("max", max)).map_err(|e| e.within("motor"))?;
        }
        check_limits(self.limits)
    }

    /// Numbers of a record: `[S, D, rest]`, `[speed, F h]`, `[lower, upper]`.
    pub const fn numbers(form: Form) -> usize {
        3 * form.spring as usize + 2 * form.motor as usize + 2 * form.limits as usize
    }

    /// Kept: impulse and error of the spring, impulse of the motor, impulses of the two limits.
    pub const fn kept(form: Form) -> usize {
        2 * form.spring as usize + form.motor as usize + 2 * form.limits as usize
    }

    pub fn place(self, h: f32, numbers: &mut [f32]) {
        let spring = self.spring.map(|spring| {
            let [s, d] = spring.coefficients(h);
            [s, d, spring.rest as f32]
        });
        let motor = self.motor.map(|motor| [motor.speed as f32, motor.max as f32 * h]);
        let limits = self.limits.map(|limits| limits.map(|x| x as f32));
        let values = spring.into_iter().flatten().chain(motor.into_iter().flatten());
        for (number, value) in numbers.iter_mut().zip(values.chain(limits.into_iter().flatten())) {
            *number = value;
        }
    }

    /// States the rows along the coordinate `value` with Jacobian `j`. `rigid` are the rows that hold the other coordinates.
    #[inline(always)]
    pub fn rows<L: Lanes, const N: usize>(
        form: Form,
        (j, rigid): (Jacobian<L>, [Jacobian<L>; N]),
        value: L,
        mut numbers: &[L],
        mut kept: &mut [L],
        on: &mut impl JointPass<L>,
    ) {
        if Axial::numbers(form) == 0 {
            return;
        }
        let ease = on.ease(&j, &rigid);
        if form.spring {
            let law = RowLaw::Spring { stiffness: numbers[0], damping: numbers[1], cap: None };
            on.free_row(j, value - numbers[2], law, &mut kept[..2], ease);
            (numbers, kept) = (&numbers[3..], &mut kept[2..]);
        }
        if form.motor {
            let law = RowLaw::Motor { speed: numbers[0], cap: numbers[1] };
            on.free_row(j, L::zero(), law, &mut kept[..1], ease);
            (numbers, kept) = (&numbers[2..], &mut kept[1..]);
        }
        if form.limits {
            on.free_row(j, value - numbers[0], RowLaw::Limit, &mut kept[..1], ease);
            on.free_row(j.reversed(), numbers[1] - value, RowLaw::Limit, &mut kept[1..2], ease);
        }
    }

    /// Sum of the impulses along the coordinate.
    pub fn impulse(form: Form, mut kept: &[f32]) -> f64 {
        let mut sum = 0.0;
        if form.spring {
            sum += f64::from(kept[0]);
            kept = &kept[2..];
        }
        if form.motor {
            sum += f64::from(kept[0]);
            kept = &kept[1..];
        }
        if form.limits {
            sum += f64::from(kept[0]) - f64::from(kept[1]);
        }
        sum
    }
}
