/** Stands in for react-syntax-highlighter, which this page has switched off. */

const PlainCode = Object.assign(() => null, { registerLanguage: () => undefined });
export default PlainCode;
