//! Tests of the whole system over real sockets and real data; see the files under `tests/`.
