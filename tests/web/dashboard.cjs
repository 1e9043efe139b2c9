// node dashboard.cjs URL SCRATCH: files and a table become a cohort, analyses are started by their forms, results are
// looked at, a job is canceled, hostile names stay text.
'use strict';
const fs = require('fs');
const path = require('path');
const { launch, open, text, waitText, press, visit, modules } = require('./browser.cjs');
const { step, tell, failures, axe } = require('./steps.cjs');
const { tryLonger } = require('./longer.cjs');

const [url, scratch] = process.argv.slice(2);
const DATA = path.join(__dirname, '../data/aal_subcortex');
const HOSTILE = '<img src=x onerror=window.hit=1>"\'&amp;{{1}}';

async function api(method, where, body, headers = {}) {
    const response = await fetch(url + where, { method, body, headers });
    return response.json();
}

async function main() {
    const browser = await launch();
    const { page, found } = await open(browser, `${url}/ui/`);

    await step('the first screen tells what to do', async () => {
        await page.waitForSelector('.drop');
        await waitText(page, 'Start a study');
        await waitText(page, 'Load the example');
    });
    await step('axe-core finds nothing on it', () => axe(page, modules));

    await step('files and a table become a cohort, with a name that is text', async () => {
        const files = fs.readdirSync(DATA).filter((f) => f.endsWith('.ply')).map((f) => path.join(DATA, f));
        const table = path.join(scratch, 'sides.csv');
        fs.writeFileSync(table, fs.readFileSync(path.join(__dirname, '../../web/example/labels.csv'), 'utf8')
            .replace('file,label,side,mirror', 'file,label,side,mirror,age').replace(/(true|false)$/gm, '$1,40')
            + `absent.ply,"${HOSTILE.replace(/"/g, '""')}",left,false,1\n`);
        const notes = path.join(scratch, 'READ ME.txt'); // beside the table, and before it in a list
        fs.writeFileSync(notes, 'These are brain nuclei.');
        await (await page.$('input[type=file]')).uploadFile(notes, ...files, table);
        await waitText(page, 'Open the cohort sides');
        await waitText(page, '1 file needs attention\\s+READ ME.txt: It has one line only');
        if (!/13 of 14 files/.test(await text(page)) || /does not fit/.test(await text(page))) return await text(page);
        if (!/Rows without a mesh: absent.ply/.test(await text(page))) return 'the row without a mesh is not told';
        await press(page, 'Open the cohort sides');
        await waitText(page, '12 members, labels left \\(6\\), right \\(6\\)');
    });
    await step('each member has a picture', async () => {
        await page.waitForFunction(() => {
            const seen = [...document.querySelectorAll('.thumb canvas')];
            return seen.length === 12 && seen.slice(0, 6).every((c) => c.getContext('2d').getImageData(0, 0, 160, 160).data.some((v) => v));
        });
    });

    await step('labels are edited in the list, and saved', async () => {
        const cell = await page.waitForSelector('input[aria-label="Subject of L_amygdala"]');
        await cell.evaluate((node) => { node.value = ''; });
        await cell.type(HOSTILE);
        await page.keyboard.press('Enter');
        await press(page, 'Save 1 change');
        await page.waitForFunction(() => ![...document.querySelectorAll('button')].some((b) => /^Save/.test(b.textContent)));
        const { members } = await api('GET', '/v1/cohorts/sides');
        const kept = members.find((m) => m.subject);
        return kept?.subject === HOSTILE && members.length === 12 || JSON.stringify(kept);
    });

    await step('cells of a spreadsheet are pasted into the list, and taken back', async () => {
        const cell = await page.waitForSelector('input[aria-label="Side of L_amygdala"]');
        await cell.evaluate((node) => {
            const event = new Event('paste', { bubbles: true, cancelable: true }); // Firefox lets no script fill a clipboard
            Object.defineProperty(event, 'clipboardData', { value: { getData: () => 'R\t3\r\nlh\t4.5\r\n' } });
            node.dispatchEvent(event);
        });
        await waitText(page, '2 by 2 cells pasted');
        const said = await page.evaluate(() => ['L_amygdala', 'L_caudate'].map((name) => ['Side', 'Time'].map((of) => document.querySelector(`input[aria-label="${of} of ${name}"]`).value).join(' ')).join(', '));
        await press(page, 'Undo 2 changes');
        await page.waitForFunction(() => ![...document.querySelectorAll('button')].some((b) => /^Save/.test(b.textContent)));
        return said === 'right 3, left 4.5' || said;
    });
    await step('a table that does not fit is told of, with the way out', async () => {
        await press(page, 'Paste a table');
        await page.type('textarea', 'file,label\n"L_amygdala,a');
        await press(page, 'Use it');
        await waitText(page, 'The quote that begins in line 2 is not closed.');
        await waitText(page, 'A table has a column file');
    });

    await step('keys count as soon as the page is drawn', async () => {
        await visit(page, '#/');
        const early = await page.evaluateOnNewDocument(() => new MutationObserver((_, observer) => {
            if (!document.querySelector('.drop')) return;
            observer.disconnect();
            for (const key of ['g', 'c']) document.body.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
        }).observe(document, { childList: true, subtree: true }));
        await page.reload();
        await page.removeScriptToEvaluateOnNewDocument(early.identifier);
        await page.waitForFunction(() => document.querySelector('main h1')?.textContent === 'Cohorts');
    });
    await step('whoever goes to a page by keys or a link is at its heading, also where it comes later', async () => {
        await visit(page, '#/');
        await page.reload();
        await page.waitForSelector('.drop');
        const at = (title) => page.waitForFunction((text) => document.activeElement.tagName === 'H1' && document.activeElement.textContent === text, {}, title);
        for (const key of ['g', 'c']) await page.keyboard.press(key);
        await at('Cohorts');
        await page.evaluate(() => { location.hash = '#/cohorts/sides'; });
        await at('sides');
    });
    await step('the form of a process starts it', async () => {
        await visit(page, '#/analyses/pca?cohort=sides');
        await page.waitForSelector('#in-cohort');
        await page.waitForFunction(() => document.querySelector('#in-cohort').value === 'sides' && document.querySelector('#in-lmax').value === '15');
        await page.$eval('#in-lmax', (node) => { node.value = '8'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await waitText(page, 'Takes (about [0-9.]+ s|less than a second) of one processor.*Needs about [0-9.]+ MB of memory');
        await page.click('#in-register');
        await waitText(page, 'Takes (about [0-9.]+ s|less than a second) of one processor.*Needs about [0-9]+ kB of memory');
        await page.$eval('#in-components', (node) => { node.value = '999'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await waitText(page, 'components: is 999; it must be');
        await page.$eval('#in-components', (node) => { node.value = ''; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await waitText(page, 'Takes (about [0-9.]+ s|less than a second) of one processor.*Needs about [0-9]+ kB of memory');
        await page.type('#job-name', HOSTILE);
        await press(page, 'Start');
        await waitText(page, 'Mean and components', 60000);
    });
    await step('scores are marks that show their shapes', async () => {
        await page.waitForFunction(() => document.querySelectorAll('.chart g[role=button]').length === 12);
        await page.$eval('.chart g[role=button]', (node) => node.focus());
        await page.keyboard.press('Enter');
        await page.waitForFunction(() => [...document.querySelectorAll('figcaption')].some((f) => /\((left|right)\)/.test(f.textContent)));
    });
    await step('a component is seen as it moves', async () => {
        await page.waitForSelector('figure.shape canvas');
        const before = await page.$eval('figure.shape canvas', (c) => c.toDataURL());
        await page.$eval('#mode-1', (node) => { node.value = '2'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await waitText(page, 'component 1: \\+2 sd');
        await waitText(page, 'Interpolated: let the slider go');
        await page.waitForFunction((was) => document.querySelector('figure.shape canvas').toDataURL() !== was, {}, before);
    });
    await step('and two are shown exactly when the slider is let go', async () => {
        const answers = [];
        const listen = (response) => response.url().includes('/shape?coefficients=2,-1.5') && answers.push(response);
        page.on('response', listen);
        await page.$eval('#mode-2', (node) => { node.value = '-1.5'; for (const name of ['input', 'change']) node.dispatchEvent(new Event(name, { bubbles: true })); });
        await waitText(page, 'Computed exactly: ', 30000);
        page.off('response', listen);
        const said = await text(page);
        const energy = Number(answers[0].headers()['srnfd-relative-energy']);
        const shown = Number(/relative energy ([0-9.e-]+)\)/.exec(said)[1]);
        return (answers.length === 1 && Math.abs(shown / energy - 1) < 0.06) || `${answers.length}, ${shown}, ${energy}`;
    });
    await step('the address has what is shown, and a link to it shows the same', async () => {
        const steps = await page.evaluate(() => history.length);
        await page.focus('figure.shape canvas');
        await page.keyboard.press('ArrowLeft');
        const seen = (of) => of.evaluate(() => [document.querySelector('figure.shape figcaption').textContent.replace(/PicturePixels.*/, ''), document.querySelector('figure.shape canvas').toDataURL(),
            document.querySelector('.chart g[aria-pressed=true]')?.getAttribute('aria-label')]);
        await page.waitForFunction(() => /sd=1:2,2:-1.5/.test(location.hash) && /view=/.test(location.hash) && /chosen=0/.test(location.hash));
        if (await page.evaluate(() => history.length) !== steps) return 'the history has grown';
        const address = page.url();
        await page.reload();
        await waitText(page, 'Computed exactly: ');
        const { page: other, found: wrong } = await open(browser, 'about:blank');
        await other.goto(address);
        await waitText(other, 'Computed exactly: ');
        // The chosen shape and the picture come when they have been fetched and drawn.
        let same = false;
        for (let k = 0; k < 100 && !same; k++) {
            const [caption, picture, mark] = await seen(page);
            same = /\+2 sd/.test(caption) && !!mark && JSON.stringify([caption, picture, mark]) === JSON.stringify(await seen(other));
            if (!same) await new Promise((resolve) => setTimeout(resolve, 200));
        }
        // What no view can show is passed over, one by one and together.
        const bad = ['', 'x', '-1', '1e999', 'NaN', '0,0,0,0,0', '1:9,99:1,x:2', '%', '%00', '<b>', '9'.repeat(3000)];
        for (const value of bad) {
            const query = ['sd', 'sliders', 'far', 'across', 'up', 'chosen', 'view'].map((name) => `${name}=${value === '%' ? '%' : encodeURIComponent(value)}`).join('&');
            await other.evaluate((q) => { location.hash = `${location.hash.split('?')[0]}?${q}`; }, query);
            await waitText(other, 'Component 1');
            await other.waitForFunction(() => /sd|mean/.test(document.querySelector('figure.shape figcaption').textContent) && document.querySelectorAll('.chart g[role=button]').length === 12);
            if (/NaN|undefined|Infinity/.test(await text(other))) return `${value.slice(0, 20)}: ${/.{40}(NaN|undefined|Infinity)/.exec(await text(other))}`;
        }
        await other.close();
        return (same && wrong.filter((w) => !w.startsWith('a request to http')).length === 0) || `${same} ${wrong.join(' | ')} ${address}`;
    });
    await step('how the members spread along it is drawn, and said', async () => {
        const said = await page.$eval('svg.spread', (node) => node.getAttribute('aria-label'));
        return /^Members along component 1.*left: mean .*; right: mean|^Members along component 1.*right: mean .*; left: mean/.test(said) || said;
    });
    await step('which leaves nothing behind', async () => {
        const { total } = await api('GET', '/v1/jobs?process=modes');
        return total === 0 || `${total} jobs`;
    });
    await step('axe-core finds nothing on the results', () => axe(page, modules));

    await step('sides of subjects are compared, with what each subject does', async () => {
        const { members } = await api('GET', '/v1/cohorts/sides');
        const { items } = await api('GET', '/v1/meshes?limit=50');
        const name = Object.fromEntries(items.map((m) => [m.id, m.name]));
        const both = members.map((m) => ({ id: m.id, side: name[m.id].startsWith('L') ? 'left' : 'right', subject: name[m.id].slice(2) + (name[m.id].includes('caudate') ? HOSTILE : '') }));
        await api('POST', '/v1/cohorts', JSON.stringify({ name: 'both', members: both }), { 'Content-Type': 'application/json' });
        await visit(page, '#/cohorts/both');
        await waitText(page, 'needs subjects and two times');
        await press(page, 'AsymmetryHow do left and right sides differ?');
        await page.waitForFunction(() => document.querySelector('#in-cohort')?.value === 'both');
        await page.$eval('#in-lmax', (node) => { node.value = '6'; node.dispatchEvent(new Event('input', { bubbles: true })); });
        await page.click('#in-register');
        await press(page, 'Start');
        await waitText(page, 'Directional asymmetry, what all subjects have in common from left to right: [0-9.]+ mm \\(95 %: [0-9.]+ to [0-9.]+\\)', 60000);
        await page.waitForFunction(() => document.querySelectorAll('figure.shape canvas').length === 2);
        const { jobs } = await api('GET', '/v1/jobs?process=asymmetry');
        const results = await api('GET', `/v1/jobs/${jobs[0].id}/results`);
        if (!(await text(page)).includes(`${+results.directional.value.toPrecision(3)} mm`)) return 'not the value of the API';
        await page.$$eval('.chart g[role=button]', (nodes) => nodes.find((n) => n.getAttribute('aria-label').startsWith('thalamus')).focus());
        await page.keyboard.press('Enter');
        await page.waitForFunction(() => document.querySelectorAll('figure.shape canvas').length === 4);
        return results.perSubject.length === 6 || results.perSubject.length;
    });
    await step('axe-core finds nothing on that', () => axe(page, modules));
    await step('and without their sizes, which the page says', async () => {
        if ((await text(page)).includes('Size was taken out')) return 'said of sizes that count';
        const inputs = { cohort: 'both', lmax: 6, register: false, scale: 'shape', permutations: 19, bootstraps: 100 };
        await api('POST', '/v1/processes/asymmetry/execution', JSON.stringify({ inputs }), { 'Content-Type': 'application/json', Prefer: 'wait=60' });
        const { jobs } = await api('GET', '/v1/jobs?process=asymmetry');
        await visit(page, `#/jobs/${jobs[0].id}`);
        await waitText(page, 'Size was taken out: the two surfaces of each subject were brought to one area', 30000);
        return jobs.length === 2 || `${jobs.length} jobs`;
    });

    await step('a job is canceled from the tray', async () => {
        await api('POST', '/v1/processes/distances/execution', JSON.stringify({ inputs: { cohort: 'sides' }, name: 'long one' }),
            { 'Content-Type': 'application/json', Prefer: 'respond-async' });
        await visit(page, '#/jobs');
        await page.reload();
        const button = await page.waitForSelector('.tray button[aria-label="Cancel long one"]');
        await button.click();
        await waitText(page, 'canceled', 30000);
    });
    await step('hostile names are text', async () => {
        const shown = await text(page);
        if (!shown.includes(HOSTILE)) return shown;
        return (await page.evaluate(() => window.hit === undefined && document.querySelectorAll('main img').length === 0)) || 'it ran';
    });
    let mended;
    await step('a mesh that is open shows its problem and is repaired by one click', async () => {
        const box = 'OFF\n8 10 0\n0 0 0\n3 0 0\n3 2 0\n0 2 0\n0 0 1\n3 0 1\n3 2 1\n0 2 1\n3 0 3 2\n3 0 2 1\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n';
        const mesh = await api('POST', '/v1/meshes?name=box', box);
        await visit(page, `#/meshes/${mesh.id}`);
        await press(page, 'Repair box');
        await waitText(page, 'box mended', 30000);
        await waitText(page, 'closed, 0, 1');
        mended = page.url().split('/').at(-1);
    });
    await step('a mesh lies under its encoding, with what was lost as a map', async () => {
        const id = (await api('GET', '/v1/meshes?name=L_caudate')).items[0].id;
        const { surface, fit } = await api('POST', '/v1/processes/encode/execution', JSON.stringify({ inputs: { mesh: id, lmax: 8 } }), { 'Content-Type': 'application/json' });
        await visit(page, `#/meshes/${id}`);
        await page.waitForFunction((of) => [...document.querySelectorAll('option')].some((o) => o.value === of), {}, surface.id);
        const choose = (label, value) => page.evaluate((l, v) => {
            const select = [...document.querySelectorAll('label')].find((node) => node.textContent.startsWith(l)).querySelector('select');
            select.value = v;
            select.dispatchEvent(new Event('change', { bubbles: true }));
        }, label, value);
        await choose('With its encoding', surface.id);
        await page.waitForSelector('option[value=between]');
        await choose('Map', 'between');
        await waitText(page, 'The two surfaces are [0-9.]+ apart');
        const [, rms, p95, max] = /are ([0-9.]+) apart.*95 % within ([0-9.]+), all within ([0-9.]+) \(mm\)/.exec(await text(page)).map(Number);
        await page.waitForFunction(() => /with=surf-.*map=between/.test(location.hash));
        const near = (a, b) => Math.abs(a / b - 1) < 0.05;
        return (near(rms, fit.rms) && near(p95, fit.p95) && near(max, fit.max)) || `${rms} ${p95} ${max}, not ${fit.rms} ${fit.p95} ${fit.max}`;
    });
    await step('landmarks are placed by a click, and without a mouse', async () => {
        await visit(page, `#/meshes/${mended}`);
        await page.waitForSelector('figure.shape canvas');
        await page.$$eval('label.check', (nodes) => nodes.find((n) => n.textContent.trim() === 'Landmarks').querySelector('input').click());
        await page.waitForSelector('ol[aria-label=Landmarks]');
        const place = await page.$eval('figure.shape canvas', (c) => { c.scrollIntoView({ block: 'center' }); const b = c.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; });
        await page.mouse.click(...place);
        await press(page, 'Landmark at the middle of the view');
        await page.waitForFunction(() => document.querySelectorAll('ol[aria-label=Landmarks] li').length === 2);
        const said = await page.$$eval('ol[aria-label=Landmarks] li span', (nodes) => nodes.map((n) => n.textContent));
        // A corner of the box, whichever is nearest.
        return (said[1] === `${said[0]} 0 mm from 1` && /^(0|3), (0|2), (0|1)$/.test(said[0])) || said.join(' | ');
    });
    await step('texts drawn out by two fifths fit 320 pixels, and none passes by the translation', async () => {
        const id = async (process) => (await api('GET', `/v1/jobs?process=${process}&status=successful`)).jobs[0].id;
        const pages = ['#/', '#/meshes', `#/meshes/${mended}`, '#/cohorts', '#/cohorts/sides', '#/analyses', '#/analyses/compare-groups?cohort=sides', '#/shapes', '#/jobs',
            `#/jobs/${await id('pca')}`, `#/jobs/${await id('asymmetry')}`, `#/jobs/${await id('encode')}`, '#/settings', '#/nowhere'];
        await page.setViewport({ width: 320, height: 700 });
        const drawn = await tryLonger(page, pages);
        await page.setViewport({ width: 1280, height: 900 });
        return drawn;
    });
    tell(found.length === 0, 'no error, no word of the policy, no request to another host', found.join(' | '));
    await browser.close();
    process.exitCode = failures() ? 1 : 0;
}
main().catch((error) => { console.error(error); process.exit(1); });
