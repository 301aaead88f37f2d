model Block "a block with a heater, in a room at 20 degC"
  parameter Real k(min=0) = 0.1 "loss over heat capacity";
  parameter Real g(min=0) = 0.1 "heater over heat capacity";
  input Real u "heater";
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20) "block";
equation
  der(T) = g*u - k*(T - 20);
end Block;
