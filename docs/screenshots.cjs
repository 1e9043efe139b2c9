// node screenshots.cjs URL FOLDER: loads the example, waits for its answers and takes dashboard-*.png of them.
'use strict';
const fs = require('fs');
const path = require('path');
const { launch, open, waitText, press, visit } = require('../tests/web/browser.cjs');

const [url, folder] = process.argv.slice(2);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

async function main() {
    const browser = await launch();
    const { page } = await open(browser, `${url}/ui/`, { width: 1200, height: 800 });
    const take = async (name) => {
        await pause(1500);
        await page.screenshot({ path: path.join(folder, `dashboard-${name}.png`), optimizeForSpeed: false });
    };
    await waitText(page, 'Start a study');
    await take('first');
    await press(page, 'Load the example');
    await waitText(page, '12 members', 60000);
    await page.waitForFunction(() => [...document.querySelectorAll('.state')].filter((s) => s.textContent === 'done').length >= 3, { timeout: 600000 });
    await page.reload();
    await waitText(page, '12 members', 60000);
    await take('cohort');
    const open_ = async (label, ready) => {
        await visit(page, '#/cohorts/example');
        await press(page, label);
        await waitText(page, ready, 60000);
    };
    await open_('Mean and components of the example', 'Component 1');
    await page.waitForSelector('#mode-1');
    await page.$eval('#mode-1', (node) => { node.value = '1.5'; for (const name of ['input', 'change']) node.dispatchEvent(new Event(name, { bubbles: true })); });
    await waitText(page, 'Computed exactly', 60000);
    await take('components');
    await open_('Left against right', 'distance of the means');
    await page.$eval('main input[type=number]', (node) => { node.value = '1'; node.dispatchEvent(new Event('input', { bubbles: true })); });
    await take('groups');
    // The sides of each nucleus, as subjects of their own.
    const send = async (route, body) => (await fetch(url + route, { method: 'POST', headers: { 'Content-Type': 'application/json', Prefer: 'wait=300' }, body: JSON.stringify(body) })).json();
    const { items } = await (await fetch(`${url}/v1/meshes?limit=50`)).json();
    await send('/v1/cohorts', { name: 'sides', members: items.map((m) => ({ id: m.id, subject: m.name.slice(2), side: m.name.startsWith('L') ? 'left' : 'right' })) });
    await send('/v1/processes/asymmetry/execution', { inputs: { cohort: 'sides', lmax: 15 }, name: 'Asymmetry of the nuclei' });
    await visit(page, '#/cohorts/sides');
    await press(page, 'Asymmetry of the nuclei');
    await waitText(page, 'Directional asymmetry', 60000);
    await page.$eval('main input[type=number]', (node) => { node.value = '1'; node.dispatchEvent(new Event('input', { bubbles: true })); });
    await take('within');
    // Six nuclei that are smoothed more and more, those of one group faster.
    const rows = [];
    for (const [i, mesh] of items.filter((m) => m.name.startsWith('L')).entries())
        for (const time of [0, 1, 3]) {
            const made = await send('/v1/processes/encode/execution', { inputs: { mesh: mesh.id, lmax: 15, parameterization: 'area', smoothing: time * (i % 2 ? 0.01 : 0.004) } });
            rows.push({ id: made.surface.id, subject: mesh.name.slice(2), time, label: i % 2 ? 'fast' : 'slow' });
        }
    await send('/v1/cohorts', { name: 'visits', members: rows });
    const at = [0, 3].flatMap((time) => ['fast', 'slow'].map((label) => ({ time, label })));
    await send('/v1/processes/trajectories/execution', { inputs: { cohort: 'visits', formula: 'shape ~ label', at }, name: 'Slopes of the nuclei' });
    await visit(page, '#/cohorts/visits');
    await press(page, 'Slopes of the nuclei');
    await waitText(page, 'In the mean the surface moves by', 60000);
    await page.waitForSelector('input[aria-label="time of the predicted shapes"]');
    await page.$eval('input[aria-label="time of the predicted shapes"]', (node) => { node.value = '2'; node.dispatchEvent(new Event('input', { bubbles: true })); node.scrollIntoView({ block: 'start' }); });
    await take('trajectories');
    await open_('Left or right?', 'Accuracy');
    await take('classification');
    // The report of the comparison, as it opens from a disk.
    const { jobs } = await (await fetch(`${url}/v1/jobs?process=compare-groups&status=successful`)).json();
    const made = await (await fetch(`${url}/v1/processes/report/execution`, {
        method: 'POST', headers: { 'Content-Type': 'application/json' },
        body: JSON.stringify({ inputs: { jobs: [jobs[0].id], title: 'Left against right' } }),
    })).json();
    const file = path.join(process.env.HOME, 'report.html');
    fs.writeFileSync(file, made.html);
    await page.goto(`file://${file}`);
    await page.waitForSelector('canvas').then((c) => c.evaluate((node) => node.closest('figure').scrollIntoView()));
    await take('report');
    await browser.close();
}
main().catch((error) => { console.error(error); process.exit(1); });
