// English drawn out by two fifths, as translations may be: vowels are doubled, so that lines may break where they could,
// and what passes by the translation is seen.
const MORE = 1.4;

function drawnOut(word: string): string {
    const long = word.replace(/[aeiouyAEIOUY]/g, (v) => v + v.toLowerCase());
    return long.padEnd(Math.ceil(MORE * word.length), 'e');
}

export const translate = (english: string): string => english.replace(/\{\d+\}|\p{L}+/gu, (part) => (part.startsWith('{') ? part : drawnOut(part)));
