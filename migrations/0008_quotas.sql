-- What an owner holds counts in full: besides content and results also what jobs were given, what they
-- keep on their way, cohorts, keys, names and records, and for each row something for itself and its
-- entries in indexes (as STORE_ROW_BYTES and its like of store/internal.h), so that many small things
-- fill a quota as few large ones do.

-- What the owner may hold, as the last request said that adds to it; 0: any amount. For what jobs add.
ALTER TABLE owner ADD COLUMN bytes_max INTEGER NOT NULL DEFAULT 0 CHECK (bytes_max >= 0);

-- Whose they are, when their job has gone already.
ALTER TABLE idempotency ADD COLUMN owner TEXT NOT NULL DEFAULT '';
ALTER TABLE checkpoint ADD COLUMN owner TEXT NOT NULL DEFAULT '';
UPDATE idempotency SET owner = coalesce((SELECT owner FROM job WHERE id = job), '');
UPDATE checkpoint SET owner = coalesce((SELECT owner FROM job WHERE id = job), '');

-- owned.bytes comes with its name, its record and its row; what was there is brought up to that.
UPDATE owned SET bytes = bytes + 1024 + coalesce(length(CAST(name AS BLOB)), 0)
                         + coalesce(length(CAST(record AS BLOB)), 0);

-- 2048 for a job, and what it was given; its results when they come (migration 4).
CREATE TRIGGER job_added AFTER INSERT ON job BEGIN
    UPDATE owner SET bytes = bytes + 2048 + length(CAST(NEW.inputs AS BLOB)) WHERE name = NEW.owner;
END;
DROP TRIGGER job_results_removed;
CREATE TRIGGER job_removed BEFORE DELETE ON job BEGIN
    UPDATE owner SET bytes = bytes - 2048 - length(CAST(OLD.inputs AS BLOB))
                             - coalesce((SELECT size FROM blob WHERE hash = OLD.results), 0)
    WHERE name = OLD.owner;
END;

-- 1024 for a key.
CREATE TRIGGER key_added AFTER INSERT ON idempotency BEGIN
    UPDATE owner SET bytes = bytes + 1024 WHERE name = NEW.owner;
END;
CREATE TRIGGER key_removed AFTER DELETE ON idempotency BEGIN
    UPDATE owner SET bytes = bytes - 1024 WHERE name = OLD.owner;
END;

CREATE TRIGGER checkpoint_added AFTER INSERT ON checkpoint BEGIN
    UPDATE owner SET bytes = bytes + (SELECT size FROM blob WHERE hash = NEW.content)
    WHERE name = NEW.owner;
END;
CREATE TRIGGER checkpoint_replaced AFTER UPDATE OF content ON checkpoint BEGIN
    UPDATE owner SET bytes = bytes + (SELECT size FROM blob WHERE hash = NEW.content)
                                   - (SELECT size FROM blob WHERE hash = OLD.content)
    WHERE name = NEW.owner;
END;
CREATE TRIGGER checkpoint_removed BEFORE DELETE ON checkpoint BEGIN
    UPDATE owner SET bytes = bytes - (SELECT size FROM blob WHERE hash = OLD.content)
    WHERE name = OLD.owner;
END;

-- 1024 for a cohort and 512 for each member, beside its text.
CREATE TRIGGER cohort_added AFTER INSERT ON cohort BEGIN
    UPDATE owner SET bytes = bytes + 1024 + 512 * NEW.members + length(CAST(NEW.record AS BLOB))
    WHERE name = NEW.owner;
END;
CREATE TRIGGER cohort_removed AFTER DELETE ON cohort BEGIN
    UPDATE owner SET bytes = bytes - 1024 - 512 * OLD.members - length(CAST(OLD.record AS BLOB))
    WHERE name = OLD.owner;
END;

UPDATE owner SET bytes =
    coalesce((SELECT sum(bytes) FROM owned WHERE owner = owner.name), 0)
    + coalesce((SELECT sum(2048 + length(CAST(inputs AS BLOB))
                           + coalesce((SELECT size FROM blob WHERE hash = job.results), 0))
                FROM job WHERE job.owner = owner.name), 0)
    + coalesce((SELECT sum(1024) FROM idempotency WHERE idempotency.owner = owner.name), 0)
    + coalesce((SELECT sum(size) FROM checkpoint JOIN blob ON hash = content
                WHERE checkpoint.owner = owner.name), 0)
    + coalesce((SELECT sum(1024 + 512 * members + length(CAST(record AS BLOB)))
                FROM cohort WHERE cohort.owner = owner.name), 0);
