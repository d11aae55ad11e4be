//! Tells the program which commit it was built from, `unknown` without git or outside of a repository, and by which
//! compiler.

use std::path::Path;
use std::process::Command;

fn git(args: &[&str]) -> Option<String> {
    said("git", args)
}

fn said(program: &str, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_string())
}

fn main() {
    // Of this package, and not of a repository that it lies in as somebody's dependency.
    let own = git(&["ls-files", "--error-unmatch", "build.rs"]).is_some();
    let commit = git(&["rev-parse", "--short=12", "HEAD"]).filter(|_| own);
    println!("cargo:rustc-env=SIMPULSE_COMMIT={}", commit.as_deref().unwrap_or("unknown"));
    let compiler = std::env::var("RUSTC").ok().and_then(|rustc| said(&rustc, &["--version"]));
    println!("cargo:rustc-env=SIMPULSE_COMPILER={}", compiler.as_deref().unwrap_or("unknown"));
    println!("cargo:rerun-if-changed=build.rs");
    // The log changes with every commit and checkout.
    if let Some(log) =
        git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|log| own && Path::new(log).exists())
    {
        println!("cargo:rerun-if-changed={log}");
    }
}
