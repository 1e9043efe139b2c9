// node processes.cjs URL SCRATCH [PROCESSES]: every process is started by its form, and its results have a view; the views of slopes,
// of several structures, of neighbours and of landmarks, with fifty hostile names, on the page and in a report. With the names of
// processes, separated by commas, only those forms.
'use strict';
const fs = require('fs');
const path = require('path');
const { launch, open, text, waitText, press, visit, modules } = require('./browser.cjs');
const { PAYLOADS, ran, unsaid } = require('./hostile.cjs');
const many = require('./many.cjs');
const { step, tell, failures, axe, note } = require('./steps.cjs');

const [url, scratch, only] = process.argv.slice(2);
const call = async (method, where, body, headers = { 'Content-Type': 'application/json' }) => {
    const raw = typeof body === 'string' || Buffer.isBuffer(body);
    const response = await fetch(url + where, { method, body: body && !raw ? JSON.stringify(body) : body, headers });
    return response.json();
};
const PATIENCE_MS = Number(process.env.SRNFD_WEB_TIMEOUT ?? 120000);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** An ellipsoid with bumps of its own, sent as coefficients. */
async function surface(name, seed, z = 1) {
    const lmax = 5;
    const rows = Object.fromEntries(['x', 'y', 'z'].map((axis) => [axis, new Array((lmax + 1) ** 2).fill(0)]));
    [rows.x[3], rows.y[1], rows.z[2]] = [1.5, 1.2, z];
    for (const axis of 'xyz')
        for (let k = 4; k < 16; k++) rows[axis][k] = 0.02 * Math.sin(1.7 * seed * k + axis.charCodeAt(0) * k * k);
    return (await call('POST', '/v1/surfaces', { name, coefficients: { lmax, ...rows } })).id;
}

/** Two surfaces of each of fifty subjects: visits, sides and structures at once. */
async function cohorts() {
    const members = [];
    for (const [i, subject] of PAYLOADS.entries())
        for (const visitNumber of [0, 1]) {
            members.push({
                id: await surface(`${subject} ${visitNumber}`, i + visitNumber / 9, 1 + visitNumber * (i % 2 ? 0.3 : 0.1)), subject, time: 60 + 2 * visitNumber, side: ['left', 'right'][visitNumber],
                label: PAYLOADS[i % 2], covariates: { part: PAYLOADS[2 + visitNumber], age: 40 + i, site: PAYLOADS[4 + (i % 2)] },
            });
        }
    await call('POST', '/v1/cohorts', { name: 'twice', members });
    await call('POST', '/v1/cohorts', { name: 'dozen', members: members.filter((m) => m.time === 60).slice(0, 12) });
    await call('POST', '/v1/cohorts', { name: 'once', members: members.filter((m) => m.time === 60) });
    // Twenty-five structures of each of six subjects, and again with the names that are left.
    for (const half of [0, 1]) {
        const parts = [];
        for (let s = 0; s < 6; s++)
            for (const [i, part] of PAYLOADS.slice(25 * half, 25 * half + 25).entries())
                parts.push({ id: await surface(`${part} ${s}`, i + s / 7, 1 + 0.2 * (s % 2)), subject: PAYLOADS[s], label: PAYLOADS[s % 2], covariates: { part } });
        await call('POST', '/v1/cohorts', { name: `structures-${half}`, members: parts });
    }
    return members.map((m) => m.id);
}

async function main() {
    const [a, b, c] = await cohorts();
    const commented = (ply) => {
        const end = ply.indexOf('\n', 4) + 1; // of the line that names the format
        return Buffer.concat([ply.subarray(0, end), Buffer.from(PAYLOADS.map((p) => `comment ${p}\n`).join('')), ply.subarray(end)]);
    };
    const data = (name) => fs.readFileSync(path.join(__dirname, '../data', name));
    const mesh = (await call('POST', `/v1/meshes?name=${encodeURIComponent(PAYLOADS[6])}`, commented(data('aal_subcortex/L_thalamus.ply')), {})).id;
    const other = (await call('POST', `/v1/meshes?name=${encodeURIComponent(PAYLOADS[7])}`, commented(data('aal_subcortex/L_pallidum.ply')), {})).id;
    const volume = (await call('POST', `/v1/volumes?name=${encodeURIComponent(PAYLOADS[8])}`, data(`aal_volume/${fs.readdirSync(path.join(__dirname, '../data/aal_volume')).find((f) => /\.nii/.test(f))}`), {})).id;
    const label = (await call('GET', `/v1/volumes/${volume}`)).labels[0].value;
    const run = (process, inputs) => call('POST', `/v1/processes/${process}/execution`, { inputs }, { 'Content-Type': 'application/json', Prefer: 'wait=300' });
    const model = (await run('pca', { cohort: 'once', register: false })).model.id;
    const classifier = (await run('train', { cohort: 'once', method: 'srnf-nn' })).model.id;
    const together = (await run('pca-parts', { cohort: 'twice', register: false, modes: 0 })).model.id;
    const joint = (await run('train-parts', { cohort: 'twice', method: 'srnf-nn', lmax: 4, commonPose: true })).model.id;

    const group = { cohort: 'once', register: false };
    // Where the axes of an ellipsoid end, more or less.
    const marks = JSON.stringify({ points: PAYLOADS.map(() => [[0.73, 0, 0], [0, 0.59, 0], [0, 0, 0.49]]), heldOut: [2] });
    const few = { permutations: 19, bootstraps: 100 };
    // What each form is given, and what its results show.
    const forms = {
        extract: [{ volume, labels: `${label}` }, 'Open, download'],
        encode: [{ mesh, lmax: 6 }, 'Open, download'],
        repair: [{ mesh }, 'Open, download'],
        mirror: [{ surface: a }, 'Open, download'],
        invert: [{ srnf: b, maxIterations: 5 }, 'Open, download'],
        geodesic: [{ from: mesh, to: other, steps: 3, landmarks: JSON.stringify({ from: [10, 200, 400], to: [30, 150, 90], heldOut: [2] }) }, 'Held out: 1 landmark'],
        register: [{ template: mesh, moving: other, landmarks: JSON.stringify({ template: [10, 200, 400], moving: [30, 150, 90], heldOut: [2] }) }, 'Held out: 1 landmark'],
        distances: [group, 'Classical scaling', 50],
        mean: [{ cohort: 'once', lmax: 4, maxIterations: 1, landmarks: marks }, 'Held out: 1 landmark', 50],
        pca: [group, 'Mean and components', 50],
        modes: [{ model, coefficients: '1, -1' }, 'sd'],
        sample: [{ model, count: 2 }, 'Open, download'],
        project: [{ model, surface: b }, 'The new subject among the others'],
        neighbours: [{ cohort: 'dozen', k: 3 }, 'those nearest to it', 12],
        score: [{ model, surface: b }, 'Percentile [0-9.]+'],
        'score of structures': [{ model: together, parts: JSON.stringify({ [PAYLOADS[2]]: a, [PAYLOADS[3]]: b }) }, 'share of the Mahalanobis distance', 4],
        'evaluate-model': [{ ...group, cohort: 'dozen', samples: 10 }, 'Generalisation'],
        'compare-groups': [{ ...group, permutations: 19 }, 'distance of the means'],
        regress: [{ ...group, cohort: 'dozen', ...few, formula: 'shape ~ age + site' }, 'Predict from 40 to 51'],
        change: [{ cohort: 'twice', register: false, ...few }, 'From time 60 to time 62 the surface moves', 50],
        asymmetry: [{ cohort: 'twice', register: false, ...few }, 'Directional asymmetry', 50],
        'pca-parts': [{ cohort: 'twice', register: false, modes: 2, relativePose: true }, 'Whose variance each component is', 50],
        'classify-parts': [{ cohort: 'structures-0', method: 'srnf-nn', lmax: 4, commonPose: true }, 'Each structure alone', 25],
        trajectories: [{ cohort: 'twice', register: false, ...few, formula: 'shape ~ site', at: JSON.stringify([60, 61, 62].flatMap((time) => [4, 5].map((i) => ({ time, site: PAYLOADS[i] })))) }, 'slopes of subjects vary about that', 50],
        classify: [{ cohort: 'once', method: 'srnf-nn', lmax: 4 }, 'Accuracy', 3],
        train: [{ cohort: 'once', method: 'srnf-nn', lmax: 4 }, 'right, each without its subject', 3],
        'train-parts': [{ cohort: 'twice', method: 'srnf-nn', lmax: 4, commonPose: true }, 'right, each without its subject', 4],
        predict: [{ model: classifier, surfaces: a }, 'before it was seen|its label and its probabilities say nothing'],
        'predict of structures': [{ model: joint, parts: JSON.stringify({ [PAYLOADS[2]]: a, [PAYLOADS[3]]: b }) }, 'beyond the model', 4],
        shoot: [{ surface: a, velocity: b, times: '0.5, 1', register: false }, 'relative energy'],
        transport: [{ from: a, to: b, vector: c, register: false }, 'Length of the vector'],
        transfer: [{ source: a, deformed: b, target: c, register: false }, 'Open, download'],
        report: [{ cohort: 'once', modes: 1 }, 'Save the report'],
    };

    const browser = await launch();
    const { page, found } = await open(browser, `${url}/ui/`);
    const jobs = {};
    const { processes } = await call('GET', '/v1/processes');
    await step('every process is known to this test', () => {
        const missing = processes.map((p) => p.id).filter((id) => !forms[id]);
        return missing.length === 0 || missing.join();
    });
    for (const [id, [inputs, shown, least = 1]] of Object.entries(forms).filter(([name]) => !only || only.split(',').includes(name))) {
        await step(`${id} is started by its form, and its results have a view`, async () => {
            await visit(page, `#/analyses/${id.split(' ')[0]}?${new URLSearchParams(inputs)}`);
            await page.waitForSelector('form.form');
            await page.waitForFunction(() => /Takes|depends on more|Estimating|No estimate/.test(document.querySelector('form').innerText));
            await waitText(page, 'Takes |depends on more');
            if (await ran(page)) return 'a name ran in the form';
            await page.type('#job-name', PAYLOADS[10]);
            await press(page, 'Start');
            await page.waitForFunction(() => /^#\/jobs\//.test(location.hash));
            await waitText(page, shown, PATIENCE_MS);
            jobs[id] = decodeURIComponent(page.url().split('#/jobs/')[1]);
            await pause(500);
            const said = await text(page);
            if (/The page failed|undefined|NaN|\[object/.test(said)) return said.match(/.{0,80}(The page failed|undefined|NaN|\[object).{0,200}/s)[0];
            if (await ran(page)) return 'a name ran';
            const missing = await unsaid(page);
            if (missing.includes(PAYLOADS[10])) return 'its name is not shown';
            return PAYLOADS.length - missing.length >= least || `${PAYLOADS.length - missing.length} names of ${least} are shown, not ${missing[0]}`;
        });
        for (const scheme of ['light', 'dark']) {
            await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
            await step(`axe-core finds nothing on the view of ${id}, ${scheme}`, () => axe(page, modules));
        }
    }

    if (only && !process.env.SRNFD_WEB_VIEWS) return browser.close();

    // ---- The views of slopes, structures, neighbours and landmarks --------------------------------------------------

    const results = {};
    for (const id of ['trajectories', 'pca-parts', 'neighbours', 'register']) results[id] = await call('GET', `/v1/jobs/${jobs[id]}/results`);
    const six = (v) => `${+v.toPrecision(3)}`;
    const all = (said) => PAYLOADS.filter((payload) => !said.replace(/\s+/g, ' ').includes(payload.replace(/\s+/g, ' ')));

    await step('fifty names of structures are text in both views of them', async () => {
        for (const half of [0, 1]) {
            const wanted = PAYLOADS.slice(25 * half, 25 * half + 25);
            for (const [process, inputs, shown] of [['pca-parts', { register: false, modes: 0 }, 'Whose variance each component is'], ['classify-parts', { method: 'srnf-nn', lmax: 4, commonPose: true }, 'Each structure alone']]) {
                const made = await run(process, { cohort: `structures-${half}`, ...inputs });
                if (!made.parts) return JSON.stringify(made).slice(0, 300);
                const { jobs: listed } = await call('GET', `/v1/jobs?process=${process}&limit=1`);
                await visit(page, `#/jobs/${listed[0].id}`);
                await waitText(page, shown);
                await pause(500);
                if (await ran(page)) return `a name ran in ${process}`;
                const missing = (await unsaid(page)).filter((payload) => wanted.includes(payload));
                if (missing.length) return `${process} lacks ${missing.length}: ${missing[0]}`;
            }
        }
    });
    await step('fifty cells of a table, in files with hostile comments, are text', async () => {
        const { files } = many.write(path.join(scratch, 'cells'), 50);
        for (const [i, file] of files.entries()) fs.appendFileSync(file, `# ${PAYLOADS[i]}\n`);
        const quoted = (cell) => `"${cell.replace(/"/g, '""')}"`;
        const table = path.join(scratch, 'cells.csv');
        fs.writeFileSync(table, ['file,label,subject,note', ...PAYLOADS.map((p, i) => ['shape-' + i + '.off', quoted(p), quoted(p), quoted(p)].join())].join('\n'));
        await visit(page, '#/');
        await (await page.waitForSelector('input[type=file]')).uploadFile(...files, table);
        await waitText(page, 'Open the cohort cells', 120000);
        await press(page, 'Open the cohort cells');
        await waitText(page, '50 members');
        await (await page.waitForSelector('.long')).evaluate((node) => { node.style.maxHeight = 'none'; });
        await page.waitForFunction(() => document.querySelectorAll('.long tbody input[aria-label^="note of"]').length === 50);
        if (await ran(page)) return 'a cell ran';
        const missing = await unsaid(page);
        return missing.length === 0 || `${missing.length}: ${missing[0]}`;
    });
    await step('what classifiers are worth is told with its intervals', async () => {
        const short = (v) => `${+v.toPrecision(2)}`;
        for (const id of ['classify', 'classify-parts', 'train']) {
            const found = await call('GET', `/v1/jobs/${jobs[id]}/results`);
            const { balancedAccuracy, auc } = found.validation ?? found.methods['srnf-nn'];
            await visit(page, `#/jobs/${jobs[id]}`);
            await page.waitForSelector('svg[aria-label*="balanced accuracy: "]', { timeout: PATIENCE_MS });
            const said = (await page.$$eval('svg[aria-label*="balanced accuracy: "]', (all) => all.map((svg) => svg.getAttribute('aria-label')))).join('; ');
            for (const rate of [balancedAccuracy, ...Object.values(auc)])
                if (!said.includes(`${short(rate.value)}, ${rate.interval.map(short).join(' to ')}`)) return `${id} lacks ${JSON.stringify(rate)}: ${said}`;
            if (id !== 'train') continue;
            const four = (v) => `${+v.toPrecision(4)}`;
            const { brier, brierInterval, logLoss, logLossInterval } = found.validation;
            const rows = await page.$$eval('tr', (all) => all.map((row) => [...row.cells].map((cell) => cell.textContent).join('|')));
            for (const [name, value, interval] of [['Brier score', brier, brierInterval], ['log loss', logLoss, logLossInterval]])
                if (!rows.some((row) => row.startsWith([name, four(value), ...interval.map(four)].join('|')))) return `no ${name} with its interval`;
        }
        return true;
    });
    await step('slopes are those of the API, with every subject by its name', async () => {
        await visit(page, `#/jobs/${jobs.trajectories}`);
        await waitText(page, 'In the mean the surface moves by');
        const said = await text(page);
        const { rate } = results.trajectories.slope;
        if (!said.includes(`${six(rate.value)} mm per unit of time (95 %: ${six(rate.interval[0])} to ${six(rate.interval[1])})`)) return 'not the rate of the API';
        const { between, betweenInterval } = results.trajectories;
        if (!said.includes(`with a variance of ${six(between)} (95 %: ${betweenInterval.map(six).join(' to ')})`)) return 'not the variance of slopes of the API';
        const missing = all(said);
        return missing.length === 0 || `${missing.length}: ${missing[0]}`;
    });
    await step('a slider of time moves the predicted surfaces of both sites', async () => {
        const slider = await page.waitForSelector('input[aria-label="time of the predicted shapes"]');
        await page.waitForFunction(() => document.querySelectorAll('section[aria-label="Predicted shapes"] canvas').length === 2);
        await pause(500);
        const seen = () => page.$$eval('section[aria-label="Predicted shapes"] canvas', (all) => all.map((canvas) => canvas.toDataURL()));
        const before = await seen();
        await slider.evaluate((node) => { node.value = '61.4'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await waitText(page, 'time 61.4 between predicted shapes');
        await pause(300);
        const after = await seen();
        return after.every((picture, i) => picture !== before[i]) || 'a picture stayed';
    });
    await step('a map of the predictions has one range of colours', async () => {
        await page.$$eval('section[aria-label="Predicted shapes"] label', (labels) => {
            const select = labels.find((l) => l.textContent.startsWith('Map')).querySelector('select');
            select.value = 'confidence';
            select.dispatchEvent(new Event('change', { bubbles: true }));
        });
        await page.waitForFunction(() => document.querySelectorAll('section[aria-label="Predicted shapes"] svg.bar').length === 2);
        const said = await page.$$eval('section[aria-label="Predicted shapes"] svg.bar', (bars) => bars.map((b) => b.getAttribute('aria-label')));
        return said[0] === said[1] || said.join(' | ');
    });
    await step('a line is chosen, and shows the visits of its subject', async () => {
        await page.$$eval('.chart g[role=button]', (nodes) => nodes.find((n) => /from 60 to 62/.test(n.getAttribute('aria-label'))).focus());
        await page.keyboard.press('Enter');
        await waitText(page, 'times as fast as the others let expect');
        await page.waitForFunction(() => [...document.querySelectorAll('.gallery figcaption')].map((f) => f.textContent).join() === 'time 60,time 62');
    });
    await step('predictions along another covariate are asked for in the view', async () => {
        await press(page, 'Predict from 60 to 62');
        await waitText(page, 'Shapes were predicted at time 60, 60.5, 61, 61.5, 62', 120000);
    });
    await step('along a covariate a linear model predicts shapes, which a slider moves', async () => {
        await visit(page, `#/jobs/${jobs.regress}`);
        await press(page, 'Predict from 40 to 51');
        await waitText(page, 'Shapes were predicted at age 40, ', 120000);
        await page.$eval('input[aria-label="age of the predicted shapes"]', (node) => { node.value = '51'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await waitText(page, 'age 51 predicted, relative energy');
        return axe(page, modules);
    });
    await step('structures move together along a joint component', async () => {
        await visit(page, `#/jobs/${jobs['pca-parts']}`);
        const slider = await page.waitForSelector('#joint-1');
        await pause(500);
        const before = await page.$eval('figure.shape canvas', (canvas) => canvas.toDataURL());
        await slider.evaluate((node) => { node.value = '2'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await waitText(page, 'component 1: \\+2 sd');
        await page.waitForFunction((was) => document.querySelector('figure.shape canvas').toDataURL() !== was, {}, before);
        await page.$eval('.chart g[role=button]', (node) => node.focus());
        await page.keyboard.press('Enter');
        await page.waitForFunction(() => document.querySelectorAll('.gallery canvas').length === 2);
        const said = await text(page);
        const shares = results['pca-parts'].parts.map((p) => `${+p.share.toPrecision(4)}`);
        return (shares.every((s) => said.includes(s)) && said.includes(PAYLOADS[2])) || `${shares}`;
    });
    await step('which are computed exactly when the slider is let go, and on the page of the model', async () => {
        const { id } = results['pca-parts'].model;
        await visit(page, `#/models/${id}`);
        await page.waitForSelector('#joint-2');
        const answers = [];
        const listen = (response) => /\/shape\?coefficients=0,-2&part=/.test(response.url()) && answers.push(response.status());
        page.on('response', listen);
        await page.$eval('#joint-2', (node) => { node.value = '-2'; for (const name of ['input', 'change']) node.dispatchEvent(new Event(name, { bubbles: true })); });
        await waitText(page, 'Computed exactly\\.', 30000);
        page.off('response', listen);
        const wrong = await axe(page, modules);
        return (wrong === true && answers.length >= 2 && answers.every((s) => s === 200 || s === 304)) || `${wrong} ${answers}`;
    });
    await step('a subject of two structures is put beside that model by a form', async () => {
        const { model, inputs } = results['pca-parts'];
        await visit(page, `#/analyses/score?model=${model.id}`);
        await page.waitForFunction(() => document.querySelectorAll('#in-parts select').length === 2);
        if (await page.$('#in-surface')) return 'a single surface is asked for';
        const { surfaces } = inputs.cohort;
        await page.select('#in-parts-0', surfaces[0]);
        await waitText(page, 'Choose a shape for ');
        await page.select('#in-parts-1', surfaces[surfaces.length / 2]);
        await waitText(page, 'Takes ');
        await press(page, 'Start');
        await waitText(page, 'Percentile [0-9.]+', 60000);
        const { jobs: listed } = await call('GET', '/v1/jobs?process=score&limit=1');
        const given = (await call('GET', `/v1/jobs/${listed[0].id}`)).inputs;
        return Object.keys(given.parts ?? {}).length === 2 || JSON.stringify(given);
    });
    await step('a mesh is sent from a form, and chosen', async () => {
        await visit(page, `#/analyses/project?model=${model}`);
        const input = await page.waitForSelector('input[aria-label="Mesh to send"]');
        const file = path.join(scratch, 'sent.ply');
        fs.copyFileSync(path.join(__dirname, '../data/aal_subcortex/L_pallidum.ply'), file);
        await input.uploadFile(file);
        await waitText(page, 'sent.ply was sent, and chosen');
        const chosen = await page.$eval('#in-surface', (node) => node.value);
        return /^mesh-/.test(chosen) || chosen;
    });
    await step('landmarks of a group are placed on one member after the other', async () => {
        await visit(page, '#/analyses/mean?cohort=dozen');
        await press(page, 'Place landmarks on the members');
        for (let i = 0; i < 12; i++) {
            await page.waitForFunction((n) => document.querySelector('fieldset select')?.value === `${n}` && document.querySelector('.small-view canvas'), {}, i);
            await pause(250);
            await page.$$eval('.small-view button', ([button]) => button.click());
            await waitText(page, `placed on ${i + 1} of 12 members`);
        }
        const wrong = await axe(page, modules);
        if (wrong !== true) return wrong;
        await waitText(page, 'Takes ');
        await page.click('#in-register');
        await page.click('#in-register');
        await page.$eval('#in-lmax', (node) => { node.value = '4'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await press(page, 'Start');
        await waitText(page, 'Guided by 1 landmark', PATIENCE_MS);
        const { jobs: listed } = await call('GET', '/v1/jobs?process=mean&limit=1');
        const { points } = (await call('GET', `/v1/jobs/${listed[0].id}`)).inputs.landmarks;
        return (points.length === 12 && points.every((p) => p.length === 1 && p[0].length === 3)) || JSON.stringify(points).slice(0, 200);
    });
    await step('a cohort gets a column, loses a member, is saved, renamed, deleted, and is there again', async () => {
        await call('POST', '/v1/cohorts', { name: 'changing', members: (await call('GET', '/v1/cohorts/dozen')).members.map(({ id, label }) => ({ id, label })) });
        await visit(page, '#/cohorts/changing');
        await page.type('input[placeholder=age]', 'dose');
        await press(page, 'Add the column');
        const cell = await page.waitForSelector('input[aria-label^="dose of"]');
        await cell.type('7');
        await page.keyboard.press('Enter');
        await page.$$eval('button[aria-label$="from the cohort"]', (all) => all.at(-1).click());
        await waitText(page, '1 member will leave');
        await press(page, 'Save 2 changes');
        await waitText(page, '11 members');
        const kept = (await call('GET', '/v1/cohorts/changing')).members;
        if (kept.length !== 11 || kept[0].covariates?.dose !== 7) return JSON.stringify(kept[0]);
        await press(page, 'Rename');
        await page.$eval('dialog input', (node) => { node.value = 'changed'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await page.$$eval('dialog[open] button.main', ([button]) => button.click());
        await page.waitForFunction(() => location.hash === '#/cohorts/changed');
        await waitText(page, '11 members');
        await press(page, 'Delete');
        await page.$$eval('dialog[open] button.risky', ([button]) => button.click());
        await waitText(page, 'The cohort changed was deleted');
        const gone = await call('GET', '/v1/cohorts/changed');
        await press(page, 'Undo');
        await page.waitForFunction(() => location.hash === '#/cohorts/changed');
        await waitText(page, '11 members');
        return gone.status === 404 || JSON.stringify(gone).slice(0, 100);
    });
    await step('lists are sorted by their columns', async () => {
        await visit(page, '#/meshes');
        await press(page, 'Faces');
        await press(page, 'Faces ▴');
        const sorted = await page.$$eval('.long tbody tr td:nth-child(3)', (cells) => cells.map((c) => +c.textContent.replace(/,/g, '')));
        return sorted.length > 2 && sorted.every((v, i) => i === 0 || v <= sorted[i - 1]) || sorted.join();
    });
    await step('a map has a range and a threshold, and landmarks measure in millimetres', async () => {
        const { surface } = await call('GET', `/v1/jobs/${jobs.change}/results`);
        await visit(page, `#/shapes/${surface.id}`);
        await page.waitForSelector('figure.shape canvas');
        await page.$eval('figcaption select', (node) => { node.value = 'effect'; node.dispatchEvent(new Event('change', { bubbles: true })); });
        await press(page, 'Range and threshold');
        await pause(300);
        const seen = () => page.$eval('figure.shape canvas', (canvas) => canvas.toDataURL());
        const before = await seen();
        const boxes = await page.$$('details[open] input[type=number]');
        const most = await page.$eval('svg.bar', (bar) => +/to ([0-9.e+-]+)$/.exec(bar.getAttribute('aria-label'))[1]);
        await boxes[1].type(`${2 * most}`);
        await pause(300);
        const wider = await seen();
        await boxes[2].type(`${10 * most}`);
        await pause(300);
        const grey = await seen();
        if (before === wider || wider === grey) return 'the colours stayed';
        if (!(await page.$eval('svg.bar', (bar) => bar.getAttribute('aria-label'))).endsWith(`to ${six(2 * most)}`)) return 'the bar has another range';
        await visit(page, `#/meshes/${mesh}`);
        await page.waitForSelector('figure.shape canvas');
        await page.$$eval('label.check', (nodes) => nodes.find((n) => n.textContent.trim() === 'Landmarks').querySelector('input').click());
        await press(page, 'Landmark at the middle of the view');
        await page.select('figcaption.row label select', '1');
        await pause(300);
        await press(page, 'Landmark at the middle of the view');
        await waitText(page, '[0-9.]+ mm from 1');
        const [a1, b1] = await page.$$eval('ol[aria-label=Landmarks] li span', (all) => all.map((n) => n.textContent));
        const place = (t) => t.split(',').map(parseFloat);
        const length = Math.hypot(...place(a1).map((v, k) => v - place(b1)[k]));
        return Math.abs(parseFloat(/([0-9.]+) mm/.exec(b1)[1]) - length) < 0.1 * Math.max(1, length) || `${a1} | ${b1}`;
    });
    await step('neighbours are listed, and chosen one after the other', async () => {
        await visit(page, `#/jobs/${jobs.neighbours}`);
        await waitText(page, 'those nearest to it');
        await page.type('input[type=search]', '7 ');
        await page.waitForFunction(() => document.querySelectorAll('.long tbody tr').length === 1);
        await page.click('.long tbody td button');
        const head = await page.$$eval('main h2', (all) => all.at(-1).textContent);
        const { labels, indices, distances } = results.neighbours;
        const i = labels.findIndex((l) => head.startsWith(l));
        await page.waitForFunction(() => document.querySelectorAll('.gallery canvas').length === 4);
        const said = await text(page);
        return (i >= 0 && indices[i].every((j, k) => said.includes(`${k + 1}: ${labels[j]}`) && said.includes(six(distances[i][k])))) || head;
    });
    await step('landmarks tell what is left at each, those held out apart', async () => {
        await visit(page, `#/jobs/${jobs.register}`);
        await waitText(page, 'Held out: 1 landmark');
        const { points, heldOut } = results.register.landmarks;
        const said = await text(page);
        return (said.includes(`${six(heldOut.maxDistance)} at most`) && said.includes(`${+points[2].distance.toPrecision(4)}`)) || said.slice(0, 400);
    });
    await step('landmarks of a form are placed by clicks on both shapes, and used', async () => {
        await visit(page, `#/analyses/register?template=${mesh}&moving=${other}`);
        await press(page, 'Place landmarks on both shapes');
        await page.waitForFunction(() => document.querySelectorAll('.small-view canvas').length === 2);
        await waitText(page, 'Takes (about|less)'); // which moves what is below it
        for (const [k, dx] of [-40, 40, 0].entries()) for (const i of [0, 1]) {
            const place = await page.$$eval('.small-view canvas', (all, k) => { all[k].scrollIntoView({ block: 'center' }); const r = all[k].getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }, i);
            await page.mouse.click(place[0] + dx, place[1]);
            await page.waitForFunction((i, next) => document.querySelectorAll('.small-view figcaption')[i].textContent.endsWith(`click for landmark ${next}`), {}, i, k + 2);
        }
        await page.waitForFunction(() => document.querySelectorAll('ol[aria-label=Landmarks] li').length === 3);
        await page.$$eval('ol[aria-label=Landmarks] input[type=checkbox]', (boxes) => boxes[2].click());
        await page.waitForFunction(() => document.querySelectorAll('ol[aria-label=Landmarks] input:checked').length === 1);
        const wrong = await axe(page, modules);
        if (wrong !== true) return wrong;
        await waitText(page, 'Takes (about|less)');
        await press(page, 'Start');
        await waitText(page, 'Guided by 2 landmarks', 120000);
        const { jobs: listed } = await call('GET', '/v1/jobs?process=register&limit=1');
        const given = (await call('GET', `/v1/jobs/${listed[0].id}`)).inputs.landmarks;
        return (given.template.length === 3 && given.moving.every(Number.isInteger) && given.heldOut.join() === '2') || JSON.stringify(given);
    });
    await step('landmarks of a mesh go into the form', async () => {
        await visit(page, `#/meshes/${mesh}`);
        await page.waitForSelector('figure.shape canvas');
        await page.$$eval('label.check', (nodes) => nodes.find((n) => n.textContent.trim() === 'Landmarks').querySelector('input').click());
        await press(page, 'Landmark at the middle of the view');
        await press(page, 'Register a shape by these');
        await page.waitForFunction((id) => document.querySelector('#in-template')?.value === id, {}, mesh);
        await page.select('#in-moving', other);
        await waitText(page, 'template: vertex [0-9]+; moving: not placed yet');
    });
    await step('points of covariates are made in a form', async () => {
        await visit(page, '#/analyses/trajectories?cohort=twice&formula=shape%20~%20site');
        await press(page, 'Five along time');
        await page.waitForFunction(() => document.querySelectorAll('input[aria-label^="time of point"]').length === 5);
        const values = await page.$$eval('input[aria-label^="time of point"]', (all) => all.map((n) => n.value).join());
        if (values !== '60,60.5,61,61.5,62') return values;
        await waitText(page, 'Takes (about|less)');
        return axe(page, modules);
    });
    await step('covariates are added to a formula by a click', async () => {
        await visit(page, '#/analyses/regress?cohort=twice');
        await press(page, '+ age');
        await press(page, '+ site');
        await page.waitForFunction(() => document.querySelector('#in-formula').value === 'shape ~ age + site');
        await press(page, 'Each site');
        const sites = await page.$$eval('input[aria-label^="site of point"]', (all) => all.map((n) => n.value).sort().join('\n'));
        if (sites !== [PAYLOADS[4], PAYLOADS[5]].sort().join('\n')) return sites;
        await waitText(page, 'Takes ');
    });
    await step('at 320 pixels no view is wider than the page', async () => {
        await page.setViewport({ width: 320, height: 700 });
        for (const id of Object.keys(forms)) for (const hash of [`#/jobs/${jobs[id]}`, `#/analyses/${id}?${new URLSearchParams(forms[id][0])}`]) {
            await visit(page, hash);
            await pause(150);
            const wide = await page.evaluate(() => document.documentElement.scrollWidth);
            if (wide > 322) return `${id} ${hash.slice(0, 12)}: ${wide}`;
        }
        await page.setViewport({ width: 1280, height: 900 });
    });

    await step('barred workers are shown to admins, and let in again', async () => {
        const bars = [{ bar: 7, worker: PAYLOADS[0], host: PAYLOADS[1], token: PAYLOADS[2], pilots: false, why: PAYLOADS[3], since: '2030-01-01T00:00:00Z', until: '2030-01-02T00:00:00Z' }];
        const lifted = [];
        const answer = (request) => {
            if (/\/v1\/workers$/.test(request.url())) return request.respond({ contentType: 'application/json', body: JSON.stringify({ executor: 'workers', items: [], bars }) });
            if (request.method() !== 'DELETE') return request.continue();
            lifted.push(new URL(request.url()).pathname);
            bars.length = 0;
            return request.respond({ status: 204 });
        };
        await page.setRequestInterception(true);
        page.on('request', answer);
        await visit(page, '#/admin');
        await waitText(page, 'computed other results than these returned');
        const missing = (await unsaid(page)).filter((payload) => PAYLOADS.slice(0, 4).includes(payload));
        const bad = (await ran(page)) || (missing.length && `not shown: ${missing[0]}`);
        const wrong = await axe(page, modules);
        await press(page, 'Lift');
        await page.$$eval('dialog[open] button.risky', ([button]) => button.click());
        await page.waitForFunction(() => !document.body.innerText.includes('computed other results'));
        page.off('request', answer);
        await page.setRequestInterception(false);
        return (!bad && wrong === true && lifted.join() === '/v1/workers/bars/7') || `${bad} ${wrong} ${lifted}`;
    });

    // ---- In a report ------------------------------------------------------------------------------------------------

    await step('a report has their sections, and opens offline', async () => {
        const made = await run('report', { jobs: ['trajectories', 'pca-parts', 'neighbours', 'register', 'score', 'mean', 'classify-parts'].map((id) => jobs[id]), title: PAYLOADS[9] });
        if (!made.html) return JSON.stringify(made);
        note(`the report has ${Math.round(made.bytes / 1000)} kB, ${made.shapes} shapes`);
        const file = path.join(scratch, 'processes.html');
        fs.writeFileSync(file, made.html);
        const report = await browser.newPage();
        const wrong = [];
        report.on('console', (m) => m.type() === 'error' && wrong.push(m.text()));
        report.on('pageerror', (e) => wrong.push(`${e}`));
        report.on('request', (r) => !/^(file|data|blob):/.test(r.url()) && wrong.push(r.url()));
        await report.goto(`file://${file}`);
        await pause(1500);
        const said = await text(report, 'body');
        const missing = all(said);
        if (missing.length || wrong.length) return `${missing.length} ${missing[0]} ${wrong.join(' | ')}`;
        if (await ran(report, 'body main')) return 'a name ran';
        const blank = await report.$$eval('canvas', (list) => list.filter((c) => !c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v)).length);
        if (blank) return `${blank} pictures are blank`;
        const before = await report.$$eval('canvas', (list) => list.map((c) => c.toDataURL()));
        for (const name of ['time of the predicted shapes', 'Component 1 of the structures'])
            await report.$eval(`input[aria-label="${name}"]`, (node) => { node.value = node.max; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await pause(500);
        const after = await report.$$eval('canvas', (list) => list.map((c) => c.toDataURL()));
        const moved = after.filter((picture, i) => picture !== before[i]).length;
        if (moved !== 3) return `${moved} pictures moved: the predictions of two sites, and the structures`;
        const { labels, indices } = results.neighbours;
        const nearest = await report.$$eval('tr', (rows) => rows.map((r) => [...r.cells].map((cell) => cell.textContent)));
        if (!nearest.some((row) => row[0] === labels[0] && row[1]?.startsWith(`${labels[indices[0][0]]} (`))) return 'no neighbours by name';
        const rate = +results.trajectories.slope.rate.value.toPrecision(6);
        if (!said.includes(`${rate}`)) return `no ${rate}`;
        const found = await axe(report, modules);
        await report.close();
        return found;
    });
    tell(found.length === 0, 'no error, no word of the policy, no request to another host', found.join(' | '));
    await browser.close();
    process.exitCode = failures() ? 1 : 0;
}
main().catch((error) => { console.error(error); process.exit(1); });
