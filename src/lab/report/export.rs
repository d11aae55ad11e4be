//! The study as `study.csv` and `study.json`.

use super::columns::SCHEMA;
use super::environment::Environment;
use super::units::is_emulated;
use crate::engine::clock::Phase;
use crate::engine::params;
use crate::engine::solvers::Uses;
use crate::engine::world::{Order, Settings};
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::curve::ErrorAxis;
use crate::lab::study::{Record, StudyPlan, search};
use serde_json::{Value, json};

/// One line of `study.csv`. Every number is finite; missing values are empty.
#[derive(serde::Serialize)]
struct TableLine<'a> {
    schema_version: u32,
    commit: &'a str,
    cpu: &'a str,
    native_lanes: usize,
    scene: &'a str,
    bodies: usize,
    dt_s: f64,
    solver: &'a str,
    order: Order,
    lanes: usize,
    lanes_emulated: bool,
    substeps: u32,
    velocity_iterations: u32,
    relax_iterations: u32,
    position_iterations: u32,
    impacts: &'a str,
    parameters: &'a str,
    swept: Option<&'a str>,
    swept_unit: Option<&'a str>,
    swept_value: Option<f64>,
    mean_step_us: Option<f64>,
    median_step_us: Option<f64>,
    longest_step_us: Option<f64>,
    rounds: Option<u32>,
    waited_share: Option<f64>,
    noise_share: Option<f64>,
    spread_us: Option<f64>,
    quartile_1_us: Option<f64>,
    quartile_3_us: Option<f64>,
    ns_per_row_sweep: Option<f64>,
    speed_up: Option<f64>,
    steps: Option<u64>,
    points: Option<u64>,
    penetration_judged_m: Option<f64>,
    flight_depth_max_m: Option<f64>,
    held_depth_p99_m: Option<f64>,
    rest_depth_max_m: Option<f64>,
    penetration_max_m: Option<f64>,
    penetration_mean_m: Option<f64>,
    penetration_rms_m: Option<f64>,
    penetration_p99_m: Option<f64>,
    penetration_relative: Option<f64>,
    penetration_excess_m: Option<f64>,
    soft_floor_m: Option<f64>,
    residual_rms_lighter_weights: Option<f64>,
    residual_rms_scene_weights: Option<f64>,
    residual_rms_body_weights: Option<f64>,
    residual_normal_rms: Option<f64>,
    residual_normal_max: Option<f64>,
    residual_tangent_rms: Option<f64>,
    residual_tangent_max: Option<f64>,
    complementarity: Option<f64>,
    cone: Option<f64>,
    dissipation: Option<f64>,
    own_residual_rms: Option<f64>,
    own_residual_max: Option<f64>,
    joint_gap_rms_m: Option<f64>,
    joint_gap_max_m: Option<f64>,
    joint_lean_max_rad: Option<f64>,
    joint_excess_max: Option<f64>,
    joint_residual_rms_lighter_weights: Option<f64>,
    joint_residual_max_lighter_weights: Option<f64>,
    joint_motor_miss_max: Option<f64>,
    joint_motor_load_max: Option<f64>,
    joint_work: Option<f64>,
    joint_spring_work: Option<f64>,
    joint_motor_work: Option<f64>,
    joint_limit_work: Option<f64>,
    momentum: Option<f64>,
    angular_momentum: Option<f64>,
    energy_change: Option<f64>,
    energy_created: Option<f64>,
    friction_loss: Option<f64>,
    impact_loss: Option<f64>,
    energy_unexplained: Option<f64>,
    rest_speed_m_s: Option<f64>,
    creep_m_s: Option<f64>,
    creep_half_width_m_s: Option<f64>,
    settled_s: Option<f64>,
    reference: Option<&'a str>,
    reference_unit: Option<&'a str>,
    reference_value: Option<f64>,
    reference_error: Option<f64>,
    contacts: Option<f64>,
    rows: Option<f64>,
    sweeps: Option<f64>,
    colors: Option<usize>,
    overflow: Option<f64>,
    occupancy: Option<f64>,
    bytes_per_contact: Option<f64>,
    bits_equal: Option<bool>,
    front_penetration: bool,
    front_residual: bool,
    front_reference: bool,
    holds: &'static str,
    failed_step: Option<u64>,
    tolerance_penetration_m: f64,
    tolerance_residual: f64,
    tolerance_reference: Option<f64>,
    tolerance_rest_speed_m_s: Option<f64>,
    plausible: bool,
    tight: bool,
    exact: bool,
    later_seconds: Option<f64>,
    later_holds: Option<&'static str>,
    later_failed_step: Option<u64>,
    later_rest_speed_m_s: Option<f64>,
    not_checked: String,
    failed_body: Option<usize>,
    failed_speed: Option<f32>,
}

impl<'a> TableLine<'a> {
    fn of(r: &'a Record, environment: &'a Environment) -> Self {
        let (sample, errors, truth) = (r.sample.as_ref(), r.errors.as_ref(), r.truth.as_ref());
        let us = |ns: f64| ns / 1e3;
        TableLine {
            schema_version: SCHEMA,
            commit: &environment.commit,
            cpu: &environment.cpu,
            native_lanes: environment.native_lanes,
            scene: &r.scene,
            bodies: r.bodies,
            dt_s: r.dt,
            solver: r.solver,
            order: r.order,
            lanes: r.lanes,
            lanes_emulated: is_emulated(r.lanes),
            substeps: r.budget.substeps,
            velocity_iterations: r.budget.velocity_iterations,
            relax_iterations: r.budget.relax_iterations,
            position_iterations: r.budget.position_iterations,
            impacts: r.impacts.name(),
            parameters: &r.parameters,
            swept: r.swept.map(|s| s.name),
            swept_unit: r.swept.map(|s| s.unit),
            swept_value: r.swept.map(|s| s.value),
            mean_step_us: sample.map(|l| us(l.mean_ns)),
            longest_step_us: sample.map(|l| us(l.worst_ns)),
            rounds: sample.map(|l| l.rounds),
            waited_share: sample.map(|l| l.waited),
            noise_share: sample.map(|l| l.noise),
            median_step_us: sample.map(|l| us(l.median_ns)),
            spread_us: sample.map(|l| us(l.spread_ns)),
            quartile_1_us: sample.map(|l| us(l.quartiles_ns[0])),
            quartile_3_us: sample.map(|l| us(l.quartiles_ns[1])),
            ns_per_row_sweep: sample.map(|l| l.row_sweep_ns),
            speed_up: r.speed_up,
            steps: errors.map(|e| e.steps),
            points: errors.map(|e| e.points),
            penetration_judged_m: ErrorAxis::Penetration.of(r),
            flight_depth_max_m: errors.map(|e| e.flight_depth_max),
            held_depth_p99_m: errors.map(|e| e.held_depth_p99),
            rest_depth_max_m: errors.map(|e| e.rest_depth_max),
            penetration_max_m: errors.map(|e| e.penetration_max),
            penetration_mean_m: errors.map(|e| e.penetration_mean),
            penetration_rms_m: errors.map(|e| e.penetration_rms),
            penetration_p99_m: errors.map(|e| e.penetration_p99),
            penetration_relative: errors.map(|e| e.penetration_relative),
            penetration_excess_m: errors.and_then(|e| e.penetration_excess),
            soft_floor_m: errors.and_then(|e| e.soft_floor),
            residual_rms_lighter_weights: errors.map(|e| e.law_rms_lighter),
            residual_rms_scene_weights: errors.map(|e| e.law_rms),
            residual_rms_body_weights: errors.map(|e| e.law_rms_body),
            residual_normal_rms: errors.map(|e| e.law_normal_rms),
            residual_normal_max: errors.map(|e| e.law_normal_max),
            residual_tangent_rms: errors.map(|e| e.law_tangent_rms),
            residual_tangent_max: errors.map(|e| e.law_tangent_max),
            complementarity: errors.map(|e| e.complementarity),
            cone: errors.map(|e| e.cone),
            dissipation: errors.map(|e| e.dissipation),
            own_residual_rms: errors.and_then(|e| e.own_rms),
            own_residual_max: errors.and_then(|e| e.own_max),
            joint_gap_rms_m: errors.and_then(|e| e.joint_gap_rms),
            joint_gap_max_m: errors.and_then(|e| e.joint_gap_max),
            joint_lean_max_rad: errors.and_then(|e| e.joint_lean_max),
            joint_excess_max: errors.and_then(|e| e.joint_excess_max),
            joint_residual_rms_lighter_weights: errors.and_then(|e| e.joint_law_rms),
            joint_residual_max_lighter_weights: errors.and_then(|e| e.joint_law_max),
            joint_motor_miss_max: errors.and_then(|e| e.joint_motor_miss_max),
            joint_motor_load_max: errors.and_then(|e| e.joint_motor_load_max),
            joint_work: errors.and_then(|e| e.joint_work),
            joint_spring_work: errors.and_then(|e| e.joint_spring_work),
            joint_motor_work: errors.and_then(|e| e.joint_motor_work),
            joint_limit_work: errors.and_then(|e| e.joint_limit_work),
            momentum: errors.map(|e| e.momentum),
            angular_momentum: errors.map(|e| e.angular_momentum),
            energy_change: errors.map(|e| e.energy_change),
            energy_created: errors.map(|e| e.energy_created),
            friction_loss: errors.map(|e| e.friction_loss),
            impact_loss: errors.map(|e| e.impact_loss),
            energy_unexplained: errors.map(|e| e.energy_unexplained),
            rest_speed_m_s: errors.map(|e| e.rest_velocity),
            creep_m_s: errors.map(|e| e.creep),
            creep_half_width_m_s: errors.map(|e| e.creep_half_width),
            settled_s: errors.and_then(|e| e.settled),
            reference: truth.map(|t| t.quantity),
            reference_unit: truth.map(|t| t.unit),
            reference_value: truth.map(|t| t.expected),
            reference_error: truth.and_then(|t| t.error),
            contacts: sample.map(|l| l.load.contacts),
            rows: sample.map(|l| l.load.rows),
            sweeps: sample.map(|l| l.load.sweeps),
            colors: sample.map(|l| l.load.colors),
            overflow: sample.map(|l| l.load.overflow),
            occupancy: sample.map(|l| l.load.occupancy),
            bytes_per_contact: sample.map(|l| l.load.bytes_per_contact),
            bits_equal: r.bits_equal,
            front_penetration: r.front.penetration,
            front_residual: r.front.law,
            front_reference: r.front.truth,
            holds: r.mark().map_or("yes", |m| m.word()),
            failed_step: r.broken.map(|b| b.step).or(r.failure.map(|f| f.step)),
            tolerance_penetration_m: r.tolerances.penetration.value,
            tolerance_residual: r.tolerances.residual.value,
            tolerance_reference: r.tolerances.truth.map(|t| t.value),
            tolerance_rest_speed_m_s: r.tolerances.rest.map(|t| t.value),
            plausible: r.is_good(Accuracy::Plausible),
            tight: r.is_good(Accuracy::Tight),
            exact: r.is_good(Accuracy::Exact),
            later_seconds: r.later.map(|l| l.seconds),
            later_holds: r.later.map(|l| l.broken.map_or("yes", |b| b.mark.word())),
            later_failed_step: r.later.and_then(|l| l.broken).map(|b| b.step),
            later_rest_speed_m_s: r.later.and_then(|l| l.rest_speed_m_s),
            not_checked: r.unchecked.join("; "),
            failed_body: r.failure.map(|f| f.body),
            failed_speed: r.failure.and_then(|f| f.speed),
        }
    }
}

/// `study.csv`: a line per record. Lengths in m, times in µs and ns, fractions in units of 1.
pub fn csv(records: &[Record], environment: &Environment) -> Result<Vec<u8>, Error> {
    let failed = |e: csv::Error| Error::invalid("study.csv", e.to_string());
    // The fixed columns are serialized first and the columns of the phases are added to each line, because no
    // writer accepts both together.
    let mut line = csv::WriterBuilder::new().from_writer(Vec::new());
    for record in records {
        line.serialize(TableLine::of(record, environment)).map_err(failed)?;
    }
    let lines = line.into_inner().map_err(|e| Error::invalid("study.csv", e.to_string()))?;
    let mut reader = csv::Reader::from_reader(&lines[..]);
    let mut writer = csv::Writer::from_writer(Vec::new());
    if !records.is_empty() {
        let mut header: Vec<String> = reader.headers().map_err(failed)?.iter().map(String::from).collect();
        header.extend(Phase::ALL.map(|phase| format!("{}_ns", phase.name().replace(' ', "_"))));
        writer.write_record(&header).map_err(failed)?;
    }
    for (row, record) in reader.records().zip(records) {
        let mut row: Vec<String> = row.map_err(failed)?.iter().map(String::from).collect();
        let ns = |phase: Phase| {
            record.sample.as_ref().map_or(String::new(), |s| s.phase_ns[phase as usize].to_string())
        };
        row.extend(Phase::ALL.map(ns));
        writer.write_record(&row).map_err(failed)?;
    }
    writer.into_inner().map_err(|e| Error::invalid("study.csv", e.to_string()))
}

/// The shortest decimal that gives the same `f32`: 0.3, not 0.30000001.
fn decimal(value: f32) -> Value {
    value.to_string().parse::<f64>().map_or(Value::Null, Value::from)
}

/// All settings of a study, chosen by the caller or constant.
pub fn settings(plan: &StudyPlan) -> Value {
    #[derive(serde::Serialize)]
    struct ExportedSolver {
        name: &'static str,
        source: &'static str,
        standard_budget: params::Budget,
        uses: Uses,
        parameters: serde_json::Map<String, Value>,
    }
    let solver = |v: &&'static crate::engine::solvers::Variant| ExportedSolver {
        name: v.name,
        source: v.source,
        standard_budget: v.budget,
        uses: v.uses,
        parameters: overrides::values(v, &plan.overrides)
            .map_or_else(|_| Default::default(), |values| overrides::by_name(v, &values)),
    };
    let standard = plan.solvers.first().map(|v| {
        let s = Settings::new(v);
        json!({
            "broadphase": format!("{:?}", s.broadphase),
            "integrator": s.integrator,
            "rotation": s.rotation,
        })
    });
    json!({
        "scenes": plan.scenes,
        "solvers": plan.solvers.iter().map(solver).collect::<Vec<_>>(),
        "lanes": plan.widths.iter().map(|w| w.lanes()).collect::<Vec<_>>(),
        "orders": plan.orders,
        "impacts": plan.impacts,
        "budgets": plan.budgets,
        "budget_search": plan.searched().then(|| json!({"rule": search::rule(), "not_searched": plan.not_searched()})),
        "steps": plan.steps,
        "timing_steps": plan.timing_steps,
        "repeats": plan.repeats,
        "set": plan.overrides,
        "sweep": plan.sweep,
        "tolerance": plan.tolerances,
        "found_to_rest": plan.rests,
        "seed": plan.seed,
        "world": standard,
        "constants": {
            "linear_slop_m": decimal(params::LINEAR_SLOP),
            "speculative_distance_m": decimal(params::SPECULATIVE_DISTANCE),
            "aabb_margin_m": decimal(params::AABB_MARGIN),
            "restitution_threshold_m_s": decimal(params::RESTITUTION_THRESHOLD),
            "max_position_correction_m": decimal(params::MAX_POSITION_CORRECTION),
            "diverged_speed_m_s": decimal(params::DIVERGED_SPEED),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::report::columns::STUDY;
    use crate::lab::study::record::tests::record;

    #[test]
    fn every_column_is_documented() {
        let bytes = csv(&[record(8, 1, 1.0, 0.0)], &Environment::current()).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        assert!(STUDY.documents(&header), "{header:?}");
        // Terms must be consistent with other studies, so these synonyms are not allowed.
        assert!(header.iter().all(|n| !n.contains("law") && !n.contains("truth") && !n.contains("mark")));
    }
}
