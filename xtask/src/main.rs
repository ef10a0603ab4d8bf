//! The developer commands: `cargo xtask demo`, `test`, `web`, `bench`, `attack`, `fuzz`, `deny`, `image`, `onnxruntime`.
//!
//! Each command prepares what a fresh machine lacks, says what it does and why, and ends with one of the exit codes
//! of `semascan` itself: 0 done, 1 the work failed, 2 a person has to do something first (the command to type is
//! printed).

mod attack;
mod bench;
mod bench_table;
mod browser;
mod budget;
mod compress;
mod demo;
mod deny;
mod dist;
mod dockerfile;
mod first_page;
mod fuzz;
mod image;
mod onnx_runtime;
mod packages;
mod pcl;
mod process;
mod report;
mod rivals;
mod tally;
mod teach;
mod test;
mod training;
mod venv;
mod wasm_sysroot;
mod wasm_target;
mod web;
mod wheel;
mod workspace;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Build, show, test and measure Semascan.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build everything and run the demo: a virtual cell, watched in the browser
    Demo(demo::Options),
    /// Run every test: training code, bundle size, Rust, browsers
    Test(test::Options),
    /// Build the viewer into www/dist
    Web(web::Options),
    /// Run the benchmarks and print one table
    Bench(bench::Options),
    /// Attack an agent with many and hostile clients, on this machine only, and print what it costs
    Attack(attack::Options),
    /// Fuzz every parser of bytes from outside
    Fuzz(fuzz::Options),
    /// Check licences, duplicate versions and origins of all dependencies
    Deny,
    /// Assemble the image of docker/Dockerfile without a daemon, run it, and see that it does what an image must
    Image(image::Options),
    /// Fetch ONNX Runtime, which runs the trained networks, into target/onnxruntime
    Onnxruntime,
}

/// Fetches it and says where it lies.
fn fetch_onnx_runtime() -> anyhow::Result<()> {
    let library = onnx_runtime::prepare(&workspace::Workspace::find()?)?;
    report::note(format!("ONNX Runtime: {}", library.display()));
    Ok(())
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().task {
        Task::Demo(options) => demo::run(&options),
        Task::Test(options) => test::run(&options),
        Task::Web(options) => web::run(&options).map(drop),
        Task::Bench(options) => bench::run(&options),
        Task::Attack(options) => attack::run(&options),
        Task::Fuzz(options) => fuzz::run_all(&options),
        Task::Deny => deny::check(),
        Task::Image(options) => image::run(&options),
        Task::Onnxruntime => fetch_onnx_runtime(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report::failure(&error);
            if error.downcast_ref::<packages::NeedsYou>().is_some() { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
    }
}
