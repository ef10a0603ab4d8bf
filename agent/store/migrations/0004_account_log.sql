-- What was done with users, tokens and logins: each entry is hashed together with the hash of the one before it, as in the log of
-- reviews. Nothing secret stands in it.

CREATE TABLE account_log (
    sequence INTEGER PRIMARY KEY,
    -- Canonical JSON.
    entry TEXT NOT NULL,
    -- SHA-256, hexadecimal.
    previous TEXT NOT NULL,
    hash TEXT NOT NULL UNIQUE
) STRICT;

CREATE TRIGGER account_log_is_not_changed BEFORE UPDATE ON account_log
BEGIN
    SELECT RAISE (ABORT, 'the log of accounts is never changed');
END;

CREATE TRIGGER account_log_is_not_removed BEFORE DELETE ON account_log
BEGIN
    SELECT RAISE (ABORT, 'nothing is removed from the log of accounts');
END;

-- INSERT OR REPLACE would remove a row without firing the trigger above.
CREATE TRIGGER account_log_is_appended BEFORE INSERT ON account_log
WHEN NEW.sequence <> (SELECT coalesce(max(sequence), 0) + 1 FROM account_log)
    OR NEW.previous <> coalesce(
        (SELECT hash FROM account_log ORDER BY sequence DESC LIMIT 1),
        '0000000000000000000000000000000000000000000000000000000000000000'
    )
    OR EXISTS (SELECT 1 FROM account_log WHERE hash = NEW.hash)
BEGIN
    SELECT RAISE (ABORT, 'an entry follows the last one of the log of accounts');
END;
