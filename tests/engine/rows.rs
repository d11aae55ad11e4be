//! The table of solvers: its rows are complete, and parameters are set by name.

use simpulse::engine::params::MAX_PARAMETERS;
use simpulse::engine::solvers::{VARIANTS, find};

#[test]
fn parameters_are_found_set_and_refused() {
    let soft = find("soft_step").unwrap();
    let mut values = soft.defaults();
    let hertz = soft.parameter("contact_hertz").unwrap();
    assert_eq!(values[hertz], 30.0);
    soft.set(&mut values, "contact-hertz", 60.0).unwrap();
    assert_eq!(values[hertz], 60.0);
    for bad in [-3.0, f32::NAN, 0.0] {
        let message = soft.set(&mut values, "contact_hertz", bad).unwrap_err().to_string();
        assert!(message.starts_with("contact_hertz: ") && message.contains(&bad.to_string()), "{message}");
    }
    assert_eq!(values[hertz], 60.0);
    let message = soft.set(&mut values, "hertz", 1.0).unwrap_err().to_string();
    assert!(message.contains("'hertz'") && message.contains("contact_hertz"), "{message}");
}

#[test]
fn rows_are_complete() {
    for v in VARIANTS {
        assert!(v.parameters.len() <= MAX_PARAMETERS, "{}", v.name);
        for p in v.parameters {
            let mut values = v.defaults();
            assert!(v.set(&mut values, p.name, p.default).is_ok(), "{} {}", v.name, p.name);
            assert!(!p.meaning.is_empty() && p.name == p.name.to_lowercase(), "{} {}", v.name, p.name);
        }
        // Iterations count something the schedule contains.
        let (none, three) = (v.of_iterations(0), v.of_iterations(3));
        assert!(none != three && three.substeps == 1, "{}", v.name);
    }
}
