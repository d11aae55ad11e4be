//! The columns of every CSV file, in one place. Tests check that no file has another header.
//!
//! A cell is empty if there is no value: a run that failed has no errors, a scene without a reference value
//! has no distance to it.

/// Version of `study.csv` and `study.json`. It is increased with every change that an older program cannot
/// read.
pub const SCHEMA: u32 = 3;

/// A column.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Name in the header. `<phase>_ns` stands for one column per phase, and so on.
    pub name: &'static str,
    /// Unit; empty for words and counts, 1 for ratios.
    pub unit: &'static str,
    /// Its content.
    pub meaning: &'static str,
}

/// A kind of CSV file.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// Usual name of the file.
    pub file: &'static str,
    /// The command that writes it.
    pub command: &'static str,
    /// What a line describes.
    pub line: &'static str,
    /// Columns, in order.
    pub columns: &'static [Column],
}

const fn column(name: &'static str, unit: &'static str, meaning: &'static str) -> Column {
    Column { name, unit, meaning }
}

/// `study.csv`
pub static STUDY: Sheet = Sheet {
    file: "study.csv",
    command: "simpulse study",
    line: "a scene, value of a sweep, solver, budget, order and lane width",
    columns: &[
        column("schema_version", "", "version of these columns"),
        column("commit", "", "commit that the program was built from"),
        column("cpu", "", "processor"),
        column("native_lanes", "", "widest lanes that the build has instructions for"),
        column("scene", "", "name with its size"),
        column("bodies", "", "bodies of the scene"),
        column("dt_s", "s", "length of a step"),
        column("solver", "", "name of the solver"),
        column("order", "", "constraint order: natural, reversed, shuffled or colored"),
        column("lanes", "", "lanes per instruction"),
        column("lanes_emulated", "", "whether the build has no instructions so wide"),
        column("substeps", "", "substeps of a step"),
        column("velocity_iterations", "", "velocity sweeps of a substep"),
        column("relax_iterations", "", "relaxation sweeps of a substep"),
        column("position_iterations", "", "position sweeps of a substep"),
        column("impacts", "", "treatment of impacts: own, waves or none"),
        column("parameters", "", "all parameters of the solver, name=value"),
        column("swept", "", "quantity that a sweep varies; empty without --sweep"),
        column("swept_unit", "", "unit of the next column; empty for a pure number"),
        column("swept_value", "*", "value of the swept quantity"),
        column("mean_step_us", "µs", "time of a step, mean over the run (each step: median over the rounds)"),
        column("median_step_us", "µs", "the same, median over the run"),
        column("longest_step_us", "µs", "the same, longest of the run"),
        column("rounds", "", "rounds common to all settings of the scene"),
        column(
            "waited_share",
            "1",
            "share of the time that the thread waited for a processor; not counted in the times",
        ),
        column("noise_share", "1", "median deviation of a repeat, over its median"),
        column("spread_us", "µs", "median deviation of a repeat from its block's median"),
        column("quartile_1_us", "µs", "lower quartile of the steps"),
        column("quartile_3_us", "µs", "upper quartile of the steps"),
        column("ns_per_row_sweep", "ns", "time of a sweep per constraint row, median"),
        column("speed_up", "1", "times faster than one lane in colored order"),
        column("steps", "", "steps over which errors were measured"),
        column("points", "", "contact points over all steps"),
        column(
            "penetration_judged_m",
            "m",
            "held_depth_p99_m; where the scene has to rest, the larger of it and rest_depth_max_m",
        ),
        column("flight_depth_max_m", "m", "largest overlap of bodies at the moment their contact was found"),
        column(
            "held_depth_p99_m",
            "m",
            "99th percentile of penetration beyond the depth at which a contact was found",
        ),
        column("rest_depth_max_m", "m", "largest penetration of the last second"),
        column("penetration_max_m", "m", "largest penetration after a step, pairs searched again"),
        column("penetration_mean_m", "m", "mean penetration of contact points; open ones count as 0"),
        column("penetration_rms_m", "m", "root mean square of the same"),
        column("penetration_p99_m", "m", "99th percentile of the same"),
        column(
            "penetration_relative",
            "1",
            "largest penetration over half the width of the thinnest dynamic shape",
        ),
        column(
            "penetration_excess_m",
            "m",
            "largest penetration of the last second beyond the static deflection of the soft contacts",
        ),
        column(
            "soft_floor_m",
            "m",
            "largest static deflection of the soft contacts under the loads of the last second",
        ),
        column(
            "residual_rms_lighter_weights",
            "1",
            "residual of the rigid contact law, rms, each point over weight of its lighter body × step",
        ),
        column(
            "residual_rms_scene_weights",
            "1",
            "residual of the rigid contact law, rms, over weight of the scene × step",
        ),
        column("residual_rms_body_weights", "1", "the same over mean weight of a body × step"),
        column("residual_normal_rms", "1", "its normal part, rms, over weight of the scene × step"),
        column("residual_normal_max", "1", "its normal part, largest"),
        column("residual_tangent_rms", "1", "its tangential part, rms"),
        column("residual_tangent_max", "1", "its tangential part, largest"),
        column("complementarity", "1", "largest violation of complementarity, over (weight × step)²/mass"),
        column("cone", "1", "largest violation of the friction cone, over weight × step"),
        column("dissipation", "1", "largest gap to maximal dissipation, over (weight × step)²/mass"),
        column("own_residual_rms", "1", "residual of the solver's own law, rms, over weight × substep"),
        column("own_residual_max", "1", "the same, largest part"),
        column(
            "joint_gap_rms_m",
            "m",
            "gap of joints, root mean square over all of them and all steps; empty without joints",
        ),
        column("joint_gap_max_m", "m", "the same, largest"),
        column("joint_lean_max_rad", "rad", "error of an angle that a joint holds, largest"),
        column("joint_excess_max", "*", "violation of a joint's limits, largest (m or rad)"),
        column(
            "joint_residual_rms_lighter_weights",
            "1",
            "residual of the law of joints, in the weight of the lighter body × step",
        ),
        column("joint_residual_max_lighter_weights", "1", "the same, largest"),
        column(
            "joint_motor_miss_max",
            "*",
            "speed that a motor misses although its impulse is below its cap, largest (m/s or rad/s)",
        ),
        column("joint_motor_load_max", "1", "impulse of a motor ÷ its cap, largest"),
        column(
            "joint_work",
            "1",
            "energy given by springs, motors and driven bodies through joints, relative",
        ),
        column("joint_spring_work", "1", "energy given by springs, relative"),
        column("joint_motor_work", "1", "energy given by motors, relative"),
        column("joint_limit_work", "1", "energy given by limits, relative; negative where bodies hit them"),
        column("momentum", "1", "momentum out of balance, relative"),
        column("angular_momentum", "1", "angular momentum out of balance, relative"),
        column("energy_change", "1", "energy gained (positive) or lost over the run, relative"),
        column("energy_created", "1", "largest energy gain in one step, relative"),
        column("friction_loss", "1", "energy dissipated by friction, relative"),
        column("impact_loss", "1", "energy dissipated by normal impulses, relative"),
        column(
            "energy_unexplained",
            "1",
            "largest energy change in one step that no impulse explains, relative",
        ),
        column("rest_speed_m_s", "m/s", "residual speed, rms over the last second"),
        column("creep_m_s", "m/s", "fastest creep of a body on another over the last second"),
        column("creep_half_width_m_s", "m/s", "half the width of its 95 % interval"),
        column("settled_s", "s", "time at which the scene came to rest; empty if it never did"),
        column("reference", "", "quantity of the reference value"),
        column("reference_unit", "", "unit of the next two columns"),
        column("reference_value", "*", "reference value of the scene"),
        column("reference_error", "*", "distance to the reference value"),
        column("contacts", "", "contacts of a step, mean"),
        column("rows", "", "constraint rows of a step, mean"),
        column("sweeps", "", "sweeps of a step over the constraints, mean"),
        column("colors", "", "colors of contacts, maximum over steps"),
        column("overflow", "", "contacts of a step that no color had room for, mean"),
        column("occupancy", "1", "share of lanes that hold a contact"),
        column("bytes_per_contact", "B", "prepared constraint records"),
        column("bits_equal", "", "whether this width gave the same bits as the error run"),
        column("front_penetration", "", "whether on the Pareto front of time against penetration"),
        column("front_residual", "", "whether on the Pareto front of time against the contact-law residual"),
        column(
            "front_reference",
            "",
            "whether on the Pareto front of time against the distance to the reference value",
        ),
        column("holds", "", "yes, or fell, slid, tunneled or blew up"),
        column("failed_step", "", "step at which it stopped holding"),
        column("tolerance_penetration_m", "m", "tolerance of penetration_judged_m in a plausible run"),
        column("tolerance_residual", "1", "tolerance of residual_rms_lighter_weights"),
        column("tolerance_reference", "*", "tolerance of reference_error, in reference_unit"),
        column(
            "tolerance_rest_speed_m_s",
            "m/s",
            "tolerance of the speed at rest; empty where nothing has to rest",
        ),
        column(
            "plausible",
            "",
            "whether the scene holds, also for a minute if it has to rest, within every tolerance",
        ),
        column("tight", "", "the same within 10 % of the tolerances"),
        column("exact", "", "the same within 1 %"),
        column("later_seconds", "s", "length of the extended run; empty without one"),
        column("later_holds", "", "yes, or what happened in the extended run"),
        column("later_failed_step", "", "step at which that happened"),
        column("later_rest_speed_m_s", "m/s", "speed over the last second of the extended run, rms"),
        column("not_checked", "", "conditions that were not checked, in words"),
        column("failed_body", "", "body that failed"),
        column("failed_speed", "m/s", "its speed, or rad/s, if it is a finite number"),
        column("<phase>_ns", "ns", "time of a phase of a step, median"),
    ],
};

/// `converge.csv`
pub static CONVERGE: Sheet = Sheet {
    file: "converge.csv",
    command: "simpulse converge",
    line: "a solver, order and start after some iterations",
    columns: &[
        column("problem", "", "name of the frozen problem"),
        column("solver", "", "name of the solver, with its stage if it is only one of several"),
        column("arithmetic", "", "f32: code of the simulation; f64: methods for comparison"),
        column("order", "", "natural, colored or shuffled"),
        column("start", "", "impulses at the start: cold (zero) or warm (those of the previous step)"),
        column("iterations", "", "iterations of the solver"),
        column("sweeps", "", "sweeps over the constraints"),
        column("time_ns", "ns", "time of these iterations, set-up excluded"),
        column("rigid_residual", "1", "residual of the rigid contact law, in the problem's unit of impulse"),
        column("own_residual", "1", "residual of the solver's own law"),
        column(
            "velocity_error",
            "1",
            "distance of the velocities from the reference, in the mass norm, relative",
        ),
    ],
};

/// `growth.csv`
pub static GROWTH: Sheet = Sheet {
    file: "growth.csv",
    command: "simpulse growth",
    line: "a size of the scene",
    columns: &[
        column("scene", "", "name with its size"),
        column("bodies", "", "bodies of the scene"),
        column("pairs", "", "candidate pairs of the step"),
        column("contacts", "", "contacts of the step"),
        column("points", "", "contact points of the step"),
        column("median_step_ns", "ns", "time of a step, median of the repeats"),
        column("mean_step_ns", "ns", "their mean"),
        column("longest_step_ns", "ns", "the longest of them"),
        column("spread_step_ns", "ns", "median deviation from the median"),
        column("<phase>_ns", "ns", "time of a phase, median"),
        column("<phase>_spread_ns", "ns", "median deviation from it"),
        column("<part>_held_bytes", "B", "memory that a part of the world holds"),
        column("<part>_used_bytes", "B", "what of it is in use"),
        column("penetration_max_m", "m", "greatest penetration of the last settling steps"),
        column(
            "residual_rms_scene_weights",
            "1",
            "residual of the rigid contact law, rms, over weight of the scene × step",
        ),
        column("residual_rms_body_weights", "1", "the same over mean weight of a body × step"),
    ],
};

/// Columns of `run --state`.
pub static STATE: Sheet = Sheet {
    file: "FILE of run --state",
    command: "simpulse run --state FILE",
    line: "a body after a step",
    columns: &[
        column("step", "", "step, from 1"),
        column("time", "s", "time after the step"),
        column("body", "", "index in the scene, from 0"),
        column("x", "m", "origin of the body's frame"),
        column("y", "m", "the same"),
        column("angle", "rad", "including whole turns since the start"),
        column("vx", "m/s", "velocity of the center of mass"),
        column("vy", "m/s", "the same"),
        column("omega", "rad/s", "angular velocity"),
    ],
};

/// Columns of `run --contacts`.
pub static CONTACTS: Sheet = Sheet {
    file: "FILE of run --contacts",
    command: "simpulse run --contacts FILE",
    line: "a contact point of a step",
    columns: &[
        column("step", "", "step, from 1"),
        column("body_a", "", "index of the first body"),
        column("body_b", "", "index of the second body"),
        column("feature", "", "which corners or edges meet; the same from step to step"),
        column("px", "m", "contact point at the start of the step"),
        column("py", "m", "the same"),
        column("nx", "1", "normal, from a to b"),
        column("ny", "1", "the same"),
        column("separation", "m", "at the start of the step; negative is penetration"),
        column("normal_impulse", "N s", "on body b over the step"),
        column("tangent_impulse", "N s", "on body b over the step, along the normal turned clockwise"),
    ],
};

/// Columns of `run --joints`.
pub static JOINTS: Sheet = Sheet {
    file: "FILE of run --joints",
    command: "simpulse run --joints FILE",
    line: "a joint after a step",
    columns: &[
        column("step", "", "step, from 1"),
        column("joint", "", "index in the scene, from 0"),
        column("type", "", "as in files: revolute, prismatic, …"),
        column("body_a", "", "index of the first body"),
        column("body_b", "", "index of the second body"),
        column("gap", "m", "size of the error of what is held along lines"),
        column("lean", "rad", "error of the angle, where it is held"),
        column("angle", "rad", "of b against a, whole turns included"),
        column("translation", "m", "of b's anchor along the axis, or distance of the anchors"),
        column("excess", "*", "beyond limits (m or rad)"),
        column(
            "rigid_1",
            "N s",
            "impulse on body b over the step: of the first rigid row along a line; empty if there is none",
        ),
        column("rigid_2", "N s", "the same of the second: x and y of the world, or across the axis"),
        column("rigid_angle", "N m s", "the same of the angle that is held"),
        column("spring_1", "N s", "the same of a spring: of x, or along the axis"),
        column("spring_2", "N s", "the same of y"),
        column("spring_angle", "N m s", "the same of the angle"),
        column("motor", "*", "the same of the motor (N s or N m s)"),
        column("lower", "*", "the same of the lower limit, ≥ 0 (N s or N m s)"),
        column("upper", "*", "the same of the upper limit, which acts the other way, ≥ 0"),
        column("force", "N", "force of the last substep"),
        column("torque", "N m", "torque of the last substep"),
        column("breaks", "", "whether they exceed the break load"),
    ],
};

/// All kinds of CSV files.
pub static SHEETS: [&Sheet; 6] = [&STUDY, &CONVERGE, &GROWTH, &STATE, &CONTACTS, &JOINTS];

impl Sheet {
    /// Names of the columns, in order.
    pub fn names(&self) -> Vec<&'static str> {
        self.columns.iter().map(|c| c.name).collect()
    }

    /// Whether a header has these columns, in this order. A column with a placeholder may occur any number of
    /// times, mixed with other such columns.
    pub fn documents(&self, header: &[&str]) -> bool {
        let is_any = |c: &Column| c.name.starts_with('<');
        let suffix = |c: &Column| c.name.split_once('>').map_or("", |(_, suffix)| suffix);
        let of_any = |name: &str| {
            self.columns
                .iter()
                .any(|c| is_any(c) && name.len() > suffix(c).len() && name.ends_with(suffix(c)))
        };
        let plain: Vec<&str> = self.columns.iter().filter(|c| !is_any(c)).map(|c| c.name).collect();
        let given: Vec<&str> = header.iter().copied().filter(|n| plain.contains(n) || !of_any(n)).collect();
        given == plain
    }
}

/// Descriptions of all columns, as text.
pub fn text() -> String {
    let mut text = String::new();
    for sheet in SHEETS {
        text += &format!("{}, written by `{}`: a line is {}\n", sheet.file, sheet.command, sheet.line);
        let width = |of: fn(&Column) -> usize| sheet.columns.iter().map(of).max().unwrap_or(0);
        let (name, unit) = (width(|c| c.name.chars().count()), width(|c| c.unit.chars().count()));
        for c in sheet.columns {
            let shown = if c.unit.is_empty() { "–" } else { c.unit };
            text += &format!("  {:<name$}  {shown:<unit$}  {}\n", c.name, c.meaning);
        }
        text += "\n";
    }
    text + "Units: – words and counts, 1 ratios, * in the unit that the line gives.\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_header_is_documented_or_not() {
        assert!(STATE.documents(&STATE.names()));
        assert!(!STATE.documents(&STATE.names()[1..]));
        let reversed: Vec<&str> = STATE.names().into_iter().rev().collect();
        assert!(!STATE.documents(&reversed));
        let mut growth: Vec<&str> = GROWTH.names().into_iter().filter(|n| !n.starts_with('<')).collect();
        growth.insert(7, "warm_start_spread_ns");
        growth.insert(7, "solve_ns");
        assert!(GROWTH.documents(&growth));
        growth.insert(7, "solve_µs");
        assert!(!GROWTH.documents(&growth));
    }

    #[test]
    fn every_column_stands_once_with_its_meaning() {
        for sheet in SHEETS {
            let names: BTreeSet<_> = sheet.names().into_iter().collect();
            assert_eq!(names.len(), sheet.columns.len(), "{}", sheet.file);
            assert!(sheet.columns.iter().all(|c| !c.meaning.is_empty()), "{}", sheet.file);
            assert!(text().contains(sheet.file));
        }
    }
}
