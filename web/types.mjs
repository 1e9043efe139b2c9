// Types of what the service takes and answers, from the description of its API: web/src/service.d.ts, or another file.
//
//   NODE_PATH=build/web/node_modules node web/types.mjs [FILE]
//
// Without texts, so that the file changes with what there is and not with what is said of it.
import { createRequire } from 'node:module';
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const web = dirname(fileURLToPath(import.meta.url));
const modules = resolve(process.env.NODE_PATH ?? join(web, '../build/web/node_modules'));
const { load } = createRequire(join(modules, '_.js'))('js-yaml');
const { default: openapiTS, astToString } = await import(pathToFileURL(join(modules, 'openapi-typescript/dist/index.mjs')).href);

/** The description without its texts; a member that is called description is kept, being a schema. */
const isSchema = (value) => value && typeof value === 'object' && !Array.isArray(value);
const bare = (value) => Array.isArray(value) ? value.map(bare)
    : value && typeof value === 'object'
        ? Object.fromEntries(Object.entries(value)
            .filter(([name, one]) => !(['description', 'summary', 'title', 'example', 'pattern', 'format', 'default'].includes(name) && !isSchema(one)))
            .map(([name, one]) => [name, bare(one)]))
        : value;

const api = bare(load(readFileSync(join(web, '../api/openapi.yaml'), 'utf8')));
api.info = { title: 'srnfd', version: '1' };
const types = astToString(await openapiTS(api, { emptyObjectsUnknown: true }));
writeFileSync(process.argv[2] ?? join(web, 'src/service.d.ts'), `// Made by web/types.mjs of api/openapi.yaml: make web\n\n${types}`);
