//! The command line of the edge agent.

fn main() {}
