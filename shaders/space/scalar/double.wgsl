// Scalar slot: numbers are f64 (device feature SHADER_F64). Only + - * /, sqrt, floor, min, max and dot are used on
// them: other f64 functions pass validation and return garbage on some drivers.
alias Real = f64;
alias Real2 = vec2<f64>;
alias Real3 = vec3<f64>;
alias Real4 = vec4<f64>;
