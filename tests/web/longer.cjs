// Pages in the language whose texts are those of English, drawn out by two fifths (web/src/longer.ts).
'use strict';
const { visit } = require('./browser.cjs');

const choose = (page, language) => page.evaluate((code) => (code ? localStorage.setItem('srnfd-language', code) : localStorage.removeItem('srnfd-language')), language);

// What is wrong with pages in it: those wider than the window, and headings, buttons and labels that are as in English.
async function tryLonger(page, hashes) {
    await choose(page, 'en-x-longer');
    await page.reload();
    const wrong = [];
    for (const hash of hashes) {
        await visit(page, hash);
        await new Promise((resolve) => setTimeout(resolve, 300));
        const seen = await page.evaluate(() => ({
            lang: document.documentElement.lang, wide: document.documentElement.scrollWidth - innerWidth, title: document.querySelector('main h1').textContent,
            // Vowels of these are doubled: a text without a double one passed by. What the service says is English.
            plain: [...document.querySelectorAll('main h2, main h3, main button, main summary, main legend, nav a, dt, th')].filter((node) => !node.closest('[lang=en], td'))
                .map((node) => node.textContent.trim()).filter((text) => /^[A-Z][a-z]+( [a-z]+)*$/.test(text) && /[aeiou]/.test(text) && !/([aeiouy])\1/i.test(text)),
        }));
        if (seen.lang !== 'en-x-longer') wrong.push(`${hash}: the language is ${seen.lang}`);
        if (seen.wide > 2) wrong.push(`${hash}: ${seen.wide} too wide`);
        if (seen.plain.length) wrong.push(`${hash}: ${[...new Set(seen.plain)].slice(0, 5).join(', ')}`);
    }
    await choose(page, '');
    await page.reload();
    return wrong.length ? wrong.join(' | ') : true;
}

module.exports = { tryLonger };
