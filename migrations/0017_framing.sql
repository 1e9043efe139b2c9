-- How the results of a job are to be framed, as the last execution that was answered by it asked (response and
-- outputs of OGC API - Processes). No row: as they are. Each counts as 1024 bytes of what the owner holds.
CREATE TABLE framing (
    job   TEXT PRIMARY KEY,
    owner TEXT NOT NULL,
    text  TEXT NOT NULL CHECK (length(text) < 1024)
) STRICT, WITHOUT ROWID;
CREATE TRIGGER framing_added AFTER INSERT ON framing BEGIN
    UPDATE owner SET bytes = bytes + 1024 WHERE name = NEW.owner;
END;
CREATE TRIGGER framing_removed AFTER DELETE ON framing BEGIN
    UPDATE owner SET bytes = bytes - 1024 WHERE name = OLD.owner;
END;
CREATE TRIGGER job_framing_removed AFTER DELETE ON job BEGIN
    DELETE FROM framing WHERE job = OLD.id;
END;
