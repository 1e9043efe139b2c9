// Lints an OpenAPI description by the rules in redocly.yaml beside this file:
//
//   node openapi.cjs FOLDER-WITH-node_modules FILE
//
// prints one line for each problem and ends with 1 if one of them is an error. Nothing is fetched.
'use strict';

const path = require('path');
const { createRequire } = require('module');

async function main(modules, file) {
    const load = createRequire(path.resolve(modules, 'package.json'));
    const { lint, loadConfig, getLineColLocation } = load('@redocly/openapi-core');
    const config = await loadConfig({ configPath: path.join(__dirname, 'redocly.yaml') });
    const problems = await lint({ ref: path.resolve(file), config });
    let errors = 0;
    for (const problem of problems) {
        if (problem.ignored) {
            continue;
        }
        // The dashboard alone ends in a slash: its files are found from there by relative addresses.
        if (problem.ruleId === 'no-path-trailing-slash' && problem.message.startsWith('`/ui/` ')) {
            continue;
        }
        const place = problem.location[0];
        // An operation that only redirects has no answer of its own.
        if (problem.ruleId === 'operation-2xx-response' && place && place.pointer.startsWith('#/paths/~1ui/get/')) {
            continue;
        }
        const where = place ? `:${getLineColLocation(place).start.line}` : '';
        errors += problem.severity === 'error' ? 1 : 0;
        console.log(`${file}${where}: ${problem.severity}: ${problem.message} [${problem.ruleId}]`);
    }
    return errors > 0 ? 1 : 0;
}

main(process.argv[2], process.argv[3]).then(
    (status) => process.exit(status),
    (error) => {
        console.log(`${process.argv[3]}: ${error.message}`);
        process.exit(1);
    }
);
