// Scalar slot: numbers are f32.
alias Real = f32;
alias Real2 = vec2<f32>;
alias Real3 = vec3<f32>;
alias Real4 = vec4<f32>;
