use simpulse::engine::solvers::VARIANTS;
use simpulse::engine::world::Settings;
use simpulse::lab::scenes::{self, CATALOG};
fn main() {
    let mut all = vec![];
    for e in CATALOG {
        let scene = scenes::load(e.name).unwrap().scene;
        for v in VARIANTS {
            if scene.runs_on(v).is_err() {
                continue;
            }
            let t = std::time::Instant::now();
            let mut w = scene.build(Settings::new(v)).unwrap();
            let b = t.elapsed().as_secs_f64();
            let steps = (40_000 / w.bodies.len().max(1)).clamp(4, 100);
            let mut n = 0;
            for _ in 0..steps {
                if w.step().is_err() {
                    break;
                }
                n += 1;
            }
            all.push((t.elapsed().as_secs_f64(), b, e.name, v.name, n, w.bodies.len()));
        }
    }
    let total: f64 = all.iter().map(|x| x.0).sum();
    println!("total {total:.1}");
    let mut by = std::collections::BTreeMap::new();
    for x in &all {
        *by.entry(x.2).or_insert(0.0) += x.0;
        *by.entry(x.3).or_insert(0.0) += x.0;
    }
    let mut by: Vec<_> = by.into_iter().collect();
    by.sort_by(|a, b| b.1.total_cmp(&a.1));
    for b in by.iter().take(24) {
        println!("{:?}", b);
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    for x in all.iter().take(30) {
        println!("{x:?}");
    }
}
