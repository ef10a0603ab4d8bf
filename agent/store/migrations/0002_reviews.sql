-- What inspections found and what was decided about it, so that lists are filtered without their records, and the log of
-- reviews. Times are RFC 3339 in UTC, identifiers UUIDs in lower case, areas in square metres.

-- Whether the rows of findings and verdict are those of its record.
ALTER TABLE inspections ADD COLUMN listed INTEGER NOT NULL DEFAULT 0 CHECK (listed IN (0, 1));
-- What counts now, decisions of people included; NULL where nobody judged.
ALTER TABLE inspections ADD COLUMN decision TEXT CHECK (decision IN ('accept', 'rework', 'person', 'reject'));
-- What follows from the criteria alone; NULL where it was not judged by any.
ALTER TABLE inspections ADD COLUMN automatic TEXT CHECK (automatic IN ('accept', 'rework', 'person', 'reject'));
-- Subjects with decisions that contradict each other.
ALTER TABLE inspections ADD COLUMN conflicts INTEGER NOT NULL DEFAULT 0;
-- Findings, those of people included; NULL where nobody looked.
ALTER TABLE inspections ADD COLUMN findings INTEGER;

CREATE INDEX inspections_by_decision ON inspections (decision, id);
CREATE INDEX inspections_not_listed ON inspections (id) WHERE listed = 0;

CREATE TABLE findings (
    inspection TEXT NOT NULL REFERENCES inspections (id) ON DELETE CASCADE,
    id TEXT NOT NULL,
    kind TEXT NOT NULL CHECK (kind IN ('defect', 'completeness', 'deviation', 'drawn')),
    component TEXT NOT NULL,
    defect TEXT,
    area REAL,
    PRIMARY KEY (inspection, id)
) STRICT, WITHOUT ROWID;

CREATE INDEX findings_by_defect ON findings (defect, inspection, component);
CREATE INDEX findings_by_component ON findings (component, inspection);

-- The log of reviews of the whole folder: each entry is hashed together with the hash of the one before it. It outlives the
-- inspections that it speaks of.
CREATE TABLE reviews (
    sequence INTEGER PRIMARY KEY,
    id TEXT NOT NULL UNIQUE,
    inspection TEXT NOT NULL,
    -- Canonical JSON.
    entry TEXT NOT NULL,
    -- SHA-256, hexadecimal.
    previous TEXT NOT NULL,
    hash TEXT NOT NULL UNIQUE
) STRICT;

CREATE INDEX reviews_by_inspection ON reviews (inspection, sequence);

CREATE TRIGGER reviews_are_not_changed BEFORE UPDATE ON reviews
BEGIN
    SELECT RAISE (ABORT, 'the log of reviews is never changed');
END;

CREATE TRIGGER reviews_are_not_removed BEFORE DELETE ON reviews
BEGIN
    SELECT RAISE (ABORT, 'nothing is removed from the log of reviews');
END;

-- INSERT OR REPLACE would remove a row without firing the trigger above.
CREATE TRIGGER reviews_are_appended BEFORE INSERT ON reviews
WHEN NEW.sequence <> (SELECT coalesce(max(sequence), 0) + 1 FROM reviews)
    OR NEW.previous <> coalesce(
        (SELECT hash FROM reviews ORDER BY sequence DESC LIMIT 1),
        '0000000000000000000000000000000000000000000000000000000000000000'
    )
    OR EXISTS (SELECT 1 FROM reviews WHERE id = NEW.id OR hash = NEW.hash)
BEGIN
    SELECT RAISE (ABORT, 'an entry follows the last one of the log of reviews');
END;
