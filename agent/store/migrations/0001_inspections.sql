-- Parts, their inspections, the views and events of these, and the messages that wait for a bus.
-- Times are RFC 3339 in UTC, identifiers UUIDs in lower case.

CREATE TABLE parts (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE
) STRICT;

CREATE TABLE inspections (
    id TEXT PRIMARY KEY,
    part INTEGER NOT NULL REFERENCES parts (id),
    source TEXT NOT NULL,
    spec TEXT NOT NULL,
    began TEXT NOT NULL,
    ended TEXT,
    state TEXT NOT NULL CHECK (state IN ('running', 'finished', 'stopped', 'failed', 'interrupted')),
    reason TEXT,
    held INTEGER NOT NULL DEFAULT 0 CHECK (held IN (0, 1)),
    -- Committed views: what a list shows needs no other table.
    views INTEGER NOT NULL DEFAULT 0
) STRICT, WITHOUT ROWID;

CREATE INDEX inspections_by_state ON inspections (state, id);
CREATE INDEX inspections_by_part ON inspections (part, id);

CREATE TABLE views (
    inspection TEXT NOT NULL REFERENCES inspections (id) ON DELETE CASCADE,
    number INTEGER NOT NULL,
    accepted INTEGER NOT NULL CHECK (accepted IN (0, 1)),
    record TEXT NOT NULL,
    PRIMARY KEY (inspection, number)
) STRICT, WITHOUT ROWID;

CREATE TABLE events (
    inspection TEXT NOT NULL REFERENCES inspections (id) ON DELETE CASCADE,
    sequence INTEGER NOT NULL,
    time TEXT NOT NULL,
    kind TEXT NOT NULL,
    PRIMARY KEY (inspection, sequence)
) STRICT, WITHOUT ROWID;

-- Files of an inspection beside the captures, with the digests by which damage shows.
CREATE TABLE files (
    inspection TEXT NOT NULL REFERENCES inspections (id) ON DELETE CASCADE,
    name TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    bytes INTEGER NOT NULL,
    PRIMARY KEY (inspection, name)
) STRICT, WITHOUT ROWID;

-- Messages for a bus, in the order of `place`, until somebody has delivered them.
CREATE TABLE outbox (
    place INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    subject TEXT NOT NULL,
    payload TEXT NOT NULL
) STRICT;
