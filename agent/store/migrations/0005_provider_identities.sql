-- Users whom an identity provider (OpenID Connect) vouches for: whom they stand for is the provider's issuer identifier and its own
-- name of the person, which together are never given to anybody else. Such a user has no password.

ALTER TABLE users ADD COLUMN issuer TEXT;
ALTER TABLE users ADD COLUMN subject TEXT CHECK ((subject IS NULL) = (issuer IS NULL) AND (issuer IS NULL OR password = ''));

CREATE UNIQUE INDEX users_by_identity ON users (issuer, subject) WHERE issuer IS NOT NULL;
