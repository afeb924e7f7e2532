//! The command line: `packstone --help`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
