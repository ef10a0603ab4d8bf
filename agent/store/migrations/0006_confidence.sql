-- Mean share of the evidence that the components of the model have, 0 to 1, over their points; NULL where it is not known, as of
-- inspections that were closed by an earlier version.
ALTER TABLE inspections ADD COLUMN confidence REAL CHECK (confidence BETWEEN 0 AND 1);
