-- The sphere that an encoding by a given parameterization was made with: it goes with that, too.
-- Those of before do not name theirs, and are made again.
DELETE FROM encoding;
ALTER TABLE encoding ADD COLUMN sphere TEXT REFERENCES mesh (id) ON DELETE CASCADE;
CREATE INDEX encoding_by_sphere ON encoding (sphere) WHERE sphere IS NOT NULL;
