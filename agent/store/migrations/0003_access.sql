-- Who may use the agent: users, their sessions, tokens of machines, and the key that signs cookies.
-- Times are RFC 3339 in UTC, in whole seconds, so that they sort as text. Digests are SHA-256, 32 bytes.

-- A name stays with its user for good: one who is removed keeps the row, and nobody else gets the name.
CREATE TABLE users (
    name TEXT PRIMARY KEY,
    role TEXT NOT NULL CHECK (role IN ('viewer', 'reviewer', 'operator', 'admin')),
    -- PHC string; empty once the user is removed.
    password TEXT NOT NULL,
    created TEXT NOT NULL,
    password_set TEXT NOT NULL,
    removed TEXT
) STRICT, WITHOUT ROWID;

CREATE TABLE sessions (
    digest BLOB PRIMARY KEY,
    user TEXT NOT NULL REFERENCES users (name) ON DELETE CASCADE,
    began TEXT NOT NULL,
    used TEXT NOT NULL
) STRICT, WITHOUT ROWID;

CREATE INDEX sessions_by_user ON sessions (user, used);

CREATE TABLE tokens (
    name TEXT PRIMARY KEY,
    role TEXT NOT NULL CHECK (role IN ('viewer', 'reviewer', 'operator', 'admin')),
    digest BLOB NOT NULL UNIQUE,
    created TEXT NOT NULL,
    expires TEXT,
    revoked TEXT
) STRICT, WITHOUT ROWID;

-- One row.
CREATE TABLE signing_key (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    key BLOB NOT NULL CHECK (length(key) = 32)
) STRICT;
