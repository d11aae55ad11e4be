//! The program; everything it does is in [`simpulse::cli`].

fn main() -> std::process::ExitCode {
    simpulse::cli::main()
}
