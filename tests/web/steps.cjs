// Steps of a browser test: each prints "ok" or "not ok", its name and what was wrong, separated by tabs.
'use strict';
let failed = 0;
function tell(good, name, detail = '') {
    if (!good) failed++;
    process.stdout.write(`${good ? 'ok' : 'not ok'}\t${name}\t${String(detail).replace(/\s+/g, ' ').slice(0, 600)}\n`);
}
async function step(name, act) {
    // axe-core is put into the page by chromium's debugger, past the policy.
    if (process.env.SRNFD_BROWSER === 'firefox' && name.startsWith('axe-core')) return note(`left out in Firefox: ${name}`);
    try {
        const wrong = await act();
        tell(wrong === undefined || wrong === true, name, wrong);
    } catch (error) {
        tell(false, name, error.stack ?? error);
    }
}
const failures = () => failed;

// What axe-core finds on the page as it is.
async function axe(page, modules) {
    const source = require('fs').readFileSync(require('path').join(modules, 'axe-core/axe.min.js'), 'utf8');
    await page.evaluate((code) => { if (!window.axe) (0, eval)(code); }, source).catch(async () => {
        // The policy forbids eval in the page, so it goes through the debugger, which the policy does not bind.
        const session = await page.createCDPSession();
        await session.send('Runtime.evaluate', { expression: source });
    });
    const found = await page.evaluate(async () => {
        const result = await window.axe.run(document, { resultTypes: ['violations'] });
        return result.violations.map((v) => `${v.id} (${v.nodes.length}): ${v.nodes.slice(0, 3).map((n) => n.target.join(' ')).join('; ')}`);
    });
    return found.length ? found.join(' | ') : true;
}
const note = (text) => process.stdout.write(`note\t${text}\t\n`);
module.exports = { step, tell, failures, axe, note };
