-- Models keep the leave-one-out values of their subjects, which others are judged by. SQLite cannot
-- change a CHECK in place, so the table is made anew; rows are kept.
CREATE TABLE model_array_new (
    model   TEXT NOT NULL REFERENCES model (id) ON DELETE CASCADE,
    name    TEXT NOT NULL CHECK (name IN ('mean_q', 'modes', 'eigenvalues', 'scores', 'calibration')),
    content TEXT NOT NULL REFERENCES blob (hash),
    PRIMARY KEY (model, name)
) STRICT;
INSERT INTO model_array_new (model, name, content) SELECT model, name, content FROM model_array;
DROP TABLE model_array;
ALTER TABLE model_array_new RENAME TO model_array;
CREATE INDEX model_array_by_content ON model_array (content);
