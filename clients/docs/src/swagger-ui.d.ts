declare module "swagger-ui" {
  /** https://swagger.io/docs/open-source-tools/swagger-ui/usage/configuration/ */
  const SwaggerUI: (configuration: Readonly<Record<string, unknown>>) => unknown;
  export default SwaggerUI;
}
