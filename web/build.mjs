// Bundles the dashboard: web/src into a folder, web/dist unless another is named.
//
//   NODE_PATH=build/web/node_modules node web/build.mjs [FOLDER]
//
// The same sources and packages give the same bytes. Every file but index.html and
// report.html has a hash of its content in its name.
import { createHash } from 'node:crypto';
import { createRequire } from 'node:module';
import { mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const web = dirname(fileURLToPath(import.meta.url));
const modules = resolve(process.env.NODE_PATH ?? join(web, '../build/web/node_modules'));
const { build } = createRequire(join(modules, '_.js'))('esbuild');
const out = resolve(process.argv[2] ?? join(web, 'dist'));

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
const result = await build({
    absWorkingDir: web,
    entryPoints: ['src/app.tsx', 'src/style.css'],
    bundle: true,
    splitting: true,
    format: 'esm',
    target: 'es2022',
    minify: true,
    legalComments: 'none',
    jsx: 'automatic',
    jsxImportSource: 'preact',
    nodePaths: [modules],
    charset: 'utf8',
    entryNames: '[name]-[hash]',
    chunkNames: '[name]-[hash]',
    outdir: out,
    metafile: true,
    logLevel: 'warning',
});

const named = (start, end) => {
    const files = readdirSync(out).filter((name) => name.startsWith(start) && name.endsWith(end));
    if (files.length !== 1) throw new Error(`${files.length} files ${start}*${end}`);
    return files[0];
};
const page = readFileSync(join(web, 'src/index.html'), 'utf8')
    .replace('app.js', named('app-', '.js'))
    .replace('style.css', named('style-', '.css'));
writeFileSync(join(out, 'index.html'), page);

// The frame of a report: one file with its style and its program, which its policy knows by their hashes. The service
// (server/processes/report_page.c) and the dashboard (src/report.ts) put title, body and data into it.
const english = {
    name: 'english', // a report is in the language that the service writes
    setup: (of) => {
        of.onResolve({ filter: /^\.\/language$/ }, () => ({ path: 'language', namespace: 'english' }));
        of.onLoad({ filter: /.*/, namespace: 'english' }, () => ({ contents: "export const language = 'en', translate = undefined;" }));
    },
};
const frame = await build({
    absWorkingDir: web, entryPoints: ['src/report_view.tsx', 'src/report.css'], bundle: true, format: 'iife',
    target: 'es2022', minify: true, legalComments: 'none', jsx: 'automatic', jsxImportSource: 'preact', nodePaths: [modules],
    charset: 'utf8', outdir: out, write: false, logLevel: 'warning', plugins: [english],
});
const textOf = (ending) => frame.outputFiles.find((file) => file.path.endsWith(ending)).text.trim();
const hash = (text) => `sha256-${createHash('sha256').update(text).digest('base64')}`;
const [program, style] = [textOf('.js'), textOf('.css')];
for (const text of [program, style])
    if (/<!--|<\/?(script|style)/i.test(text)) throw new Error('the program or style of reports would end its element');
const parts = { STYLE: hash(style), SCRIPT: hash(program), 'style.css': style, 'program.js': program };
writeFileSync(join(out, 'report.html'), readFileSync(join(web, 'src/report.html'), 'utf8')
    .replace(/STYLE|SCRIPT|style\.css|program\.js/g, (name) => parts[name]));

// What is bundled of others, with their licences, goes along.
const used = new Set();
for (const output of Object.values(result.metafile.outputs))
    for (const input of Object.keys(output.inputs)) {
        const name = /node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(input)?.[1];
        if (name) used.add(name);
    }
const licences = [...used].sort().map((name) => {
    const folder = join(modules, name);
    const file = readdirSync(folder).find((f) => /^licen[cs]e/i.test(f));
    const { version } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
    return `${name} ${version}\n\n${readFileSync(join(folder, file), 'utf8').trim()}\n`;
});
writeFileSync(join(out, 'licences.txt'), licences.join('\n'));
